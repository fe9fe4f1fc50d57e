"""A show from start to end: the frame loop, its timing, and everything it opens and closes."""
