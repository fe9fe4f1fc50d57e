"""Benchmarks: each module has `run() -> dict`, prints a table and returns its figures."""
