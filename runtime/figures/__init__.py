"""The figures of Celikcan et al. 2015, section 6, drawn anew from what our solvers do."""
