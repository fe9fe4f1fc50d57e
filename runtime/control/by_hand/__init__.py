"""Mapping by hand with the mouse: what is under it, what lights up, and what each click does."""
