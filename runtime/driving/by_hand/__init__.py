"""Mapping by hand: the chains that can be chosen, and the pairs made of them."""
