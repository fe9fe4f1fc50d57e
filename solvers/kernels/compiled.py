"""How every hot kernel is compiled, and how many threads may run it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from importlib import import_module
from typing import TypeVar, cast

from threadpoolctl import ThreadpoolController

# Threads that wait for work must sleep, not spin: a performance shares its cores with the renderer
# and the devices, and a spinning thread takes the core that the last working one needs (measured on
# two busy cores: 3 ms a tick instead of 38). OpenMP reads this when numba first loads it.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numba

# Below this many vertices a second thread costs as much as it gives: between frames it has fallen
# asleep, and in a show the other cores are the renderer's and the devices' (measured frame by frame
# in `bunraku bench latency`: even at 15 000 vertices on free cores, worse beside a busy one).
_WORTH_SHARING = 20_000

_Function = TypeVar("_Function", bound=Callable[..., object])


def kernel(function: _Function) -> _Function:
    """Compile a function ahead of its second run: cached on disk, reductions may be reordered.

    The order is fixed when the code is compiled, so that two runs still agree to the last bit.
    NaN and infinity keep their meaning, but ask of a value whether it is one, not of a sum: terms
    of that may cancel. Other threads go on meanwhile: a device's must stamp what
    arrives when it arrives.
    """
    return cast(
        _Function,
        numba.njit(
            cache=True,
            nogil=True,
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
            nogil=True,
            parallel=True,
            error_model="numpy",
            fastmath={"reassoc", "contract", "nsz", "arcp"},
            boundscheck=False,
        )(function),
    )


@contextmanager
def threads_for(vertices: int) -> Iterator[None]:
    """Run the kernels within on as many threads as so many vertices are worth."""
    if vertices >= _WORTH_SHARING:
        yield
        return
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def most_threads() -> int:
    """How many threads a kernel may run on, so that each can have room of its own."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def one_blas_thread() -> AbstractContextManager[object]:
    """Let dense products within use the calling thread only.

    A BLAS whose threads spin while they wait takes the cores that the kernels' threads need.
    """
    limited: AbstractContextManager[object] = _blas().limit(limits=1, user_api="blas")
    return limited


@cache
def _blas() -> ThreadpoolController:
    import_module("scipy.linalg.cython_blas")  # what compiled kernels call; found once it is loaded
    return ThreadpoolController()
