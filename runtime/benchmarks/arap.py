"""Benchmark: an iteration of ARAP, beside libigl's C++ on the same mesh in the same run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numba import get_num_threads, prange
from numpy.typing import NDArray

from runtime.benchmarks.torus import pulled_patch, torus
from solvers.arap import ArapSolver
from solvers.deform.arap_cells import SPOKES, build_cells
from solvers.deform.arap_kernels import fit_cells, residual
from solvers.deform.arap_layout import lay_out
from solvers.deform.rotation_fit import SCRATCH
from solvers.kernels.compiled import most_threads, parallel_kernel, threads_for
from solvers.linear.constrained_system import ConstrainedSystem, Constraints

SIZES = (2_500, 10_000, 40_000, 160_000)
REPEATS = 9
ITERATIONS = 5  # in the longer of two solves; the difference of the two is iterations only

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def run(sizes: Sequence[int] = SIZES) -> dict[str, object]:
    """Print and return a table: the median of milliseconds per iteration, ours and libigl's."""
    bandwidth = _bandwidth()
    threads = get_num_threads()
    print(f"arap: one iteration, up to {threads} threads; copying moves {bandwidth:.0f} GB/s")
    print(
        f"{'vertices':>9} {'ours ms':>8} {'libigl':>8} {'times':>6} {'a tick':>7} {'local':>7}"
        f" {'rhs':>7} {'solve':>7} {'MB':>6} {'of copy':>7} {'build s':>8}"
    )
    rows = []
    for size in sizes:
        row = _measure(*torus(size))
        row["share_of_copying"] = row["megabytes"] / row["ours_ms"] / bandwidth
        rows.append(row)
        peer = row["libigl_ms"]
        print(
            f"{row['vertices']:>9} {row['ours_ms']:8.3f} "
            + (f"{peer:8.2f} {peer / row['ours_ms']:6.1f} " if peer else f"{'-':>8} {'-':>6} ")
            + f"{row['tick_ms']:7.3f} {row['local_ms']:7.3f} {row['rhs_ms']:7.3f}"
            f" {row['solve_ms']:7.3f} {row['megabytes']:6.1f} {row['share_of_copying']:6.0%}"
            f" {row['build_s']:8.2f}",
            flush=True,
        )
    return {"threads": threads, "bandwidth_gb_s": bandwidth, "sizes": rows}


def _measure(vertices: Floats, faces: Ints) -> dict[str, Any]:
    """Measure both solvers in turn on the same handles and targets, under the same load."""
    handles, targets = pulled_patch(vertices)
    start = perf_counter()
    ours = ArapSolver(vertices, faces, handles)
    build = perf_counter() - start
    answer = ours.solve(targets, ITERATIONS)
    peer = _libigl(vertices, faces, handles, targets, answer)
    stages, moved = _stages(vertices, faces, handles)
    for stage in stages.values():
        stage()  # compile it and touch its memory before it is timed
    calls: dict[str, Callable[[], object]] = {
        "one": partial(ours.solve, targets, 1),
        "many": partial(ours.solve, targets, ITERATIONS),
        **stages,
    }
    if peer is not None:
        calls |= {"peer one": partial(peer, 1), "peer many": partial(peer, ITERATIONS)}
    times: dict[str, list[float]] = {name: [] for name in calls}
    with threads_for(len(vertices)):
        for _ in range(REPEATS):
            for name, call in calls.items():
                times[name].append(_milliseconds(call))
    median = {name: float(np.median(values)) for name, values in times.items()}
    return {
        "vertices": len(vertices),
        "ours_ms": (median["many"] - median["one"]) / (ITERATIONS - 1),
        "libigl_ms": (median["peer many"] - median["peer one"]) / (ITERATIONS - 1)
        if peer is not None
        else None,
        "tick_ms": median["one"],
        **{name: median[name] for name in stages},
        "megabytes": moved / 1e6,
        "build_s": build,
    }


def _stages(
    vertices: Floats, faces: Ints, handles: Ints
) -> tuple[dict[str, Callable[[], object]], int]:
    """Return the three stages of an iteration, and the bytes that an iteration must move."""
    layout = lay_out(vertices, faces)
    x = vertices[layout.order].copy()
    mesh = build_cells(x, layout.faces, SPOKES)
    constraints = Constraints(np.zeros(len(x), dtype=np.bool_), np.zeros(len(x)))
    constraints.fixed[layout.place[handles]] = True
    system = ConstrainedSystem(mesh.laplacian, layout.tree, constraints)
    R, laplace_x, b = np.empty((len(x), 9)), np.empty_like(x), np.zeros_like(x)
    room = np.empty((most_threads(), SCRATCH))
    arrays = mesh.cells.fits, mesh.cells.pulls, mesh.cells.own
    moved = sum(array.nbytes for array in arrays) + 2 * mesh.cells.neighbours.nbytes
    moved += system.nbytes + 2 * (R.nbytes + laplace_x.nbytes + b.nbytes) + 3 * x.nbytes
    return {
        "local_ms": lambda: fit_cells(x, mesh.cells, R, laplace_x, room),
        "rhs_ms": lambda: residual(R, laplace_x, mesh.cells, constraints.fixed, b),
        "solve_ms": lambda: system.add_solution(b, x),
    }, moved


def _libigl(
    vertices: Floats, faces: Ints, handles: Ints, targets: Floats, start: Floats
) -> Callable[[int], object] | None:
    """Return a function that runs libigl's solver for n iterations; None without libigl."""
    try:
        import igl  # noqa: PLC0415  # an optional extra
    except ImportError:
        return None
    data = igl.ARAPData()
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES
    data.max_iter = 1
    igl.arap_precomputation(vertices, faces, 3, handles.astype(np.int32), data)

    def solve(iterations: int) -> object:
        data.max_iter = iterations
        return igl.arap_solve(targets, data, start)

    return solve


def _milliseconds(call: Callable[[], object]) -> float:
    start = perf_counter()
    call()
    return 1e3 * (perf_counter() - start)


@parallel_kernel
def _copy(source: Floats, target: Floats) -> None:
    for i in prange(len(source)):
        target[i] = source[i]


def _bandwidth() -> float:
    """Return the gigabytes a second that all cores together copy; caches may be faster."""
    source, target = np.ones(8_000_000), np.empty(8_000_000)
    _copy(source, target)
    best = min(_milliseconds(lambda: _copy(source, target)) for _ in range(8))
    return 2 * source.nbytes / best / 1e6
