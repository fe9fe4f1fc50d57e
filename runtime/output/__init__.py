"""Outputs of a show: files, streams to other programs, and the report."""
