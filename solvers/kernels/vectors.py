"""Short vectors of numbers in kernels, kept in registers: `s += load(array, at, 8) * 2.0`.

Two modules define them. The first keeps them in registers and needs parts of numba that are not
public. The second is slower and needs public parts only; it serves where numba has changed.
"""

from __future__ import annotations

try:
    from solvers.kernels.llvm_vectors import lane, load, load_row, repeat_three, store, zeros
except (ImportError, AttributeError, TypeError):
    from solvers.kernels.array_vectors import lane, load, load_row, repeat_three, store, zeros

__all__ = ["lane", "load", "load_row", "repeat_three", "store", "zeros"]
