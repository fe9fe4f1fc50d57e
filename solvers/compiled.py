"""How every hot kernel is compiled, and how many threads may run it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., object])


def kernel(function: _Function) -> _Function:
    """Compile a function ahead of its second run: cached on disk, reductions may be reordered.

    The order is fixed when the code is compiled, so that two runs still agree to the last bit.
    NaN and infinity keep their meaning.
    """
    return cast(
        _Function,
        numba.njit(
            cache=True,
            error_model="numpy",
            fastmath={"reassoc", "contract", "nsz", "arcp"},
            boundscheck=False,
        )(function),
    )


def parallel_kernel(function: _Function) -> _Function:
    """Compile like `kernel`, with `prange` loops spread over the cores.

    Such a loop must write disjoint outputs and must not reduce, or else the result would depend
    on the number of cores.
    """
    return cast(
        _Function,
        numba.njit(
            cache=True,
            parallel=True,
            error_model="numpy",
            fastmath={"reassoc", "contract", "nsz", "arcp"},
            boundscheck=False,
        )(function),
    )
