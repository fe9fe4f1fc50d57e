"""Benchmarks: each module measures one part of the program; `bunraku bench NAME` runs it."""
