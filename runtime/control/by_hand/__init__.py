"""Choosing by hand: what lies under the mouse, what lights up, and what each click does."""
