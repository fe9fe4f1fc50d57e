"""The decorators that compile a kernel, and the number of threads that may run it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import cache, wraps
from importlib import import_module
from threading import Lock
from typing import Any, TypeVar, cast

from threadpoolctl import ThreadpoolController

# Threads that wait for work must sleep, not spin: a performance shares its cores with the renderer
# and the devices, and a spinning thread takes the core that the last working one needs (measured on
# two busy cores: 3 ms a tick instead of 38). OpenMP reads this when numba first loads it.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numba

from solvers.kernels.cache import KernelCache

_REORDERED = {"reassoc", "contract", "nsz", "arcp"}

# Below this many vertices a second thread costs as much as it gives: between frames it has fallen
# asleep, and in a show the other cores are the renderer's and the devices' (measured frame by frame
# in `bunraku bench latency`: even at 15 000 vertices on free cores, worse beside a busy one).
_WORTH_SHARING = 20_000

_LAUNCH = Lock()

_Function = TypeVar("_Function", bound=Callable[..., object])


def kernel(function: _Function) -> _Function:
    """Compile a function at its first call, cached on disk; sums may be reordered.

    The order is fixed when the code is compiled, so that two runs agree to the last bit. NaN and
    infinity keep their meaning, but test the values and not a sum of them: its terms may cancel.
    Other threads run meanwhile: a device must stamp a packet when it arrives.
    """
    return _compiled(function, nogil=True, fastmath=_REORDERED, boundscheck=False)


def parallel_kernel(function: _Function) -> _Function:
    """Compile like `kernel`, with `prange` loops spread over the cores.

    Such a loop must write disjoint outputs and must not reduce, or else the result would depend
    on the number of cores. Kernels cannot call it. Calls from several threads take turns: one of
    numba's threading layers ends the process when two calls overlap.
    """
    compiled = _compiled(
        function, nogil=True, parallel=True, fastmath=_REORDERED, boundscheck=False
    )

    @wraps(function)
    def launch(*operands: object) -> object:
        with _LAUNCH:
            return compiled(*operands)

    return cast(_Function, launch)


def exact_kernel(function: _Function) -> _Function:
    """Compile a function at its first call, cached on disk; arithmetic is done as it is written.

    For the few hot loops of decoders and of the fill stage. They take microseconds and keep the
    interpreter's lock: to get it back from a busy frame loop takes longer. Between two frames the
    solvers sweep the processor's caches, and every NumPy call that must be fetched again takes 10
    to 30 us; a whole compiled loop takes no more than one of them.
    """
    return _compiled(function)


def _compiled(function: _Function, **options: Any) -> _Function:
    compiled = numba.njit(error_model="numpy", **options)(function)
    compiled._cache = KernelCache(compiled)
    return cast(_Function, compiled)


@contextmanager
def threads_for(vertices: int) -> Iterator[None]:
    """Run parallel kernels on one thread if the mesh is small, and on all threads otherwise."""
    if vertices >= _WORTH_SHARING:
        yield
        return
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def run_together(work: Callable[[int, int], None], firsts: list[int], lasts: list[int]) -> None:
    """Call work(first, last) for each pair, at the same time where kernels may share the cores.

    `work` must consist of kernels that are not parallel and write disjoint outputs.
    """
    threads = min(numba.get_num_threads(), len(firsts))
    if threads < 2:
        for first, last in zip(firsts, lasts, strict=True):
            work(first, last)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, firsts, lasts):
            pass  # raises here where the work raised


def most_threads() -> int:
    """The number of threads that a parallel kernel may use; each needs its own scratch memory."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]  # numba makes it as it starts


def one_blas_thread() -> AbstractContextManager[object]:
    """Let dense products use the calling thread only.

    A BLAS whose threads spin while they wait takes the cores that the kernels' threads need.
    """
    limited: AbstractContextManager[object] = _blas().limit(limits=1, user_api="blas")
    return limited


@cache
def _blas() -> ThreadpoolController:
    import_module("scipy.linalg.cython_blas")  # the BLAS that kernels call; found once it is loaded
    return ThreadpoolController()
