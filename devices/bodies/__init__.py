"""Skeletons of people: what joints are called, which body part each is, and standard bodies."""
