"""How the few hot loops of decoders, and of the fill stage, are compiled.

Between two frames the solvers sweep the caches, and every NumPy call that has to be fetched again
then takes 10 to 30 us; a whole compiled loop takes no more than one of them. These loops last
microseconds and keep the interpreter's lock: getting it back from a busy frame loop takes longer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., object])


def kernel(function: _Function) -> _Function:
    """Compile a function at its first call, cached on disk; arithmetic is done as it is written.

    Whoever owns a kernel calls it once when it is made, so that no packet waits for the compiler.
    """
    return cast(_Function, numba.njit(cache=True, error_model="numpy")(function))
