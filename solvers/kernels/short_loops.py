"""Short loops in place of NumPy lines that numba compiles slowly: an assignment, a median.

Numba checks the sizes in `out[:] = values` by code that formats text for an error message, and
takes a median by a selection of its own: a second of compiling for each kernel with such a line.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import exact_kernel


@exact_kernel
def put(out: Any, values: Any) -> None:
    """Write `values` (n,) to `out` (n,), which shares no memory with it or is the same."""
    for i in range(len(out)):
        out[i] = values[i]


@exact_kernel
def median(values: NDArray[np.float64]) -> float:
    """The median of numbers (n,), n > 0, none of them NaN; as `np.median` has it."""
    ordered = values.copy()
    for i in range(1, len(ordered)):
        value, at = ordered[i], i
        while at > 0 and ordered[at - 1] > value:
            ordered[at] = ordered[at - 1]
            at -= 1
        ordered[at] = value
    half = len(ordered) // 2
    if len(ordered) % 2 == 1:
        return float(ordered[half])
    return float((ordered[half - 1] + ordered[half]) / 2.0)
