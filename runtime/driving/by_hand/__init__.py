"""Mapping by hand: the chains that can be chosen, and the pairs that are made of them."""
