"""Matching one puppet to a performer: which mapping is chosen, and what drives until then."""
