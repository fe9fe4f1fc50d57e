"""Measurements of a show: the JSON report and what is counted for it."""
