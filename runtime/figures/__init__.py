"""The figures of Celikcan et al. 2015, section 6, drawn with our solvers."""
