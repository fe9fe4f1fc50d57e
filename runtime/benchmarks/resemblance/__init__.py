"""Measures of how a character resembles the performer who drives it."""
