"""Filters and statistics over time series of points."""
