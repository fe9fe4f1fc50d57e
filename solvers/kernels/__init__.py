"""How kernels are compiled and cached; vectors and quaternions for use in them."""

from solvers.kernels.processor import choose_processor

choose_processor()
