"""Outputs for other programs and machines while the show runs."""
