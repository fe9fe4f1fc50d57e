"""Sparse linear algebra for the global step of the deformation."""
