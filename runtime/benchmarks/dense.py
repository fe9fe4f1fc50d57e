"""Benchmark: the time that a proxy saves on a dense character, and its error.

Proxy and full solve deform the same character in the same run, frame by frame, with the same
handles. The table shows the proxy's distance from the full solve and, to compare with, the full
solve's own distance from the converged answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from replay.builtin import builtin_recording
from replay.recording import Recording
from runtime.characters.builtin import builtin_character
from runtime.characters.character import Character
from runtime.characters.proxy import DENSE, PROXY, Proxy, proxy_of
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show
from solvers.arap import ArapSolver
from solvers.surface.decimation import decimate
from solvers.surface.edges import Edges

SIZES = (10_000, 20_000, 40_000, 100_000, 160_000, 300_000)
FRAMES = 100
STEP = 4  # frames of the recording from one to the next: 15 a second, as from a slow camera
COMPARED = 10  # performed frames from one comparison to the next
ITERATIONS = 2  # a tick, as in a show
SETTLED = 60  # iterations of the converged answer
MOST_SETTLED = 50_000  # the largest number of vertices for which it is computed

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Figures = dict[str, float]

RINGS = ShowSettings(match=MatchSettings(driver="relative"))  # a show whose surface has handles


def run(sizes: Sequence[int] = SIZES, frames: int = FRAMES) -> dict[str, object]:
    """Print and return a table: the median of milliseconds a tick, and the error."""
    print(f"dense: {ITERATIONS} iterations a tick, {get_num_threads()} threads, proxy over {DENSE}")
    print(
        f"{'vertices':>8} {'full ms':>8} {'proxy':>6} {'follow':>6} {'times':>5} {'GB/s':>5}"
        f" {'RMS %':>6} {'p99 %':>6} {'stretch':>13} {'normals':>12} {'settled %':>9}"
        f" {'build s':>13}"
    )
    rows = []
    for size in sizes:
        settle = size <= MOST_SETTLED
        row = measure(dense_character(size), builtin_recording(), settle=settle, frames=frames)
        rows.append(row)
        print(_line(row), flush=True)
    return {"threads": get_num_threads(), "iterations": ITERATIONS, "sizes": rows}


def _line(row: dict[str, Any]) -> str:
    settled = f"{row['settled']['rms']:9.3f}" if row["settled"] else f"{'-':>9}"
    error = row["error"]
    return (
        f"{row['vertices']:>8} {row['full_ms']:8.2f} {row['proxy_ms']:6.2f} {row['follow_ms']:6.2f}"
        f" {row['full_ms'] / row['proxy_ms']:5.1f} {row['follow_gb_s']:5.1f}"
        f" {error['rms']:6.3f} {error['p99']:6.3f}"
        f" {error['stretch_full']:6.3f} {error['stretch']:6.3f}"
        f" {error['normals_mean']:5.1f} {error['normals_p99']:6.1f} {settled}"
        f" {row['full_build_s']:6.2f} {row['proxy_build_s']:6.2f}"
    )


def dense_character(count: int) -> Character:
    """Return the mannequin with about `count` vertices: Loop subdivision, then decimation."""
    import trimesh  # noqa: PLC0415  # slow to import

    character = builtin_character("mannequin")
    vertices, faces = character.vertices, character.faces
    while len(vertices) < 0.98 * count:
        finer = trimesh.Trimesh(vertices, faces, process=False).subdivide_loop()
        vertices, faces = np.asarray(finer.vertices), np.asarray(finer.faces, dtype=np.int64)
    if len(vertices) > 1.02 * count:
        thinned = decimate(vertices, faces, count)
        vertices, faces = vertices[thinned.kept], thinned.faces
    return replace(
        character,
        vertices=np.ascontiguousarray(vertices),
        faces=faces,
        weights=None,
        morphs=None,
    )


@dataclass(frozen=True, slots=True)
class _Handles:
    """The handles: coarse vertices (H,), their groups (H,), and targets (H, 3) for each frame."""

    chosen: Ints
    groups: Ints
    targets: list[Floats]


def measure(
    character: Character, recording: Recording, *, settle: bool, frames: int = FRAMES
) -> dict[str, Any]:
    """Perform with proxy and full solve; return median times [ms] and errors over all frames.

    Args:
        character: a character of any size.
        recording: the performance that drives it.
        settle: whether to compare with the converged answer, too.
        frames: the number of frames from the start of the recording.
    """
    start = perf_counter()
    proxy = proxy_of(character, dense=0, count=min(PROXY, len(character.vertices) // 2))
    handles = _perform(character, proxy, recording, frames)
    coarse = ArapSolver(proxy.vertices, proxy.faces, handles.chosen, groups=handles.groups)
    built = perf_counter()
    chosen = proxy.kept[handles.chosen]
    full = ArapSolver(character.vertices, character.faces, chosen, groups=handles.groups)
    built_full = perf_counter()
    patient = None
    if settle:
        patient = ArapSolver(character.vertices, character.faces, chosen, groups=handles.groups)
    times, errors, unsettled = [], [], []
    comparison = Comparison(character.vertices, character.faces)
    for number, targets in enumerate(handles.targets):
        stamps = [perf_counter()]
        answer = full.solve(targets, ITERATIONS)
        stamps.append(perf_counter())
        moved = coarse.solve(targets, ITERATIONS)
        stamps.append(perf_counter())
        followed = proxy.follow(moved)
        stamps.append(perf_counter())
        times.append(1e3 * np.diff(stamps))
        if number % COMPARED == COMPARED - 1:
            errors.append(comparison.figures(followed, answer))
            if patient is not None:
                unsettled.append(comparison.figures(answer, patient.solve(targets, SETTLED)))
    full_ms, solve_ms, follow_ms = np.median(times, axis=0).tolist()
    moved_bytes = proxy.surface.bytes_moved if proxy.surface is not None else 0
    return {
        "vertices": len(character.vertices),
        "proxy_vertices": len(proxy.vertices),
        "full_ms": full_ms,
        "proxy_ms": solve_ms + follow_ms,
        "follow_ms": follow_ms,
        "follow_gb_s": moved_bytes / 1e6 / follow_ms,
        "follow_bytes_a_vertex": moved_bytes / len(character.vertices),
        "error": _over_all(errors),
        "settled": _over_all(unsettled),
        "proxy_build_s": built - start,
        "full_build_s": built_full - built,
    }


def _perform(character: Character, proxy: Proxy, recording: Recording, frames: int) -> _Handles:
    """Perform with a puppet of the proxy and return its handles."""
    weights = None if character.weights is None else character.weights[proxy.kept]
    coarse = replace(
        character, vertices=proxy.vertices, faces=proxy.faces, weights=weights, morphs=None
    )
    targets: list[Floats] = []
    with Show(play(_thinned(recording), every_frame=True), [coarse], RINGS) as show:
        binding = show.puppets[0].bound_skeleton.binding
        while len(targets) < frames and show.tick():
            targets.append(show.vertices[0][binding.handles])
    return _Handles(binding.handles, binding.anchor, targets)


def _thinned(recording: Recording) -> Recording:
    """Every `STEP`-th frame of a recording."""
    rotations = recording.rotations
    return replace(
        recording,
        times=recording.times[::STEP],
        positions=recording.positions[::STEP],
        rotations=None if rotations is None else rotations[::STEP],
        confidence=recording.confidence[::STEP],
        performers=recording.performers[::STEP],
        arrivals=recording.arrivals[::STEP],
    )


class Comparison:
    """Measures the difference of two deformed states of a surface.

    Args:
        vertices: (N, 3) at rest.
        faces: (F, 3).
    """

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        self._rest, self._faces = vertices, faces
        self._edges = Edges.of(vertices, faces)
        self._size = float(np.linalg.norm(np.ptp(vertices, axis=0)))

    def figures(self, found: Floats, full: Floats) -> Figures:
        """Return the distance of `found` (N, 3) from `full` (N, 3).

        Returns:
            rms, p99: distance of the vertices, percent of the diagonal of the rest pose's box;
            stretch, stretch_full: 99th percentile of |l / l0 - 1| of the edges of each;
            normals_mean, normals_p99: angle between the vertices' normals [degrees].
        """
        gap = 100.0 * np.linalg.norm(found - full, axis=1) / self._size
        cosine = np.einsum("ij,ij->i", self._normals(found), self._normals(full))
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return {
            "rms": float(np.sqrt(np.mean(gap**2))),
            "p99": float(np.percentile(gap, 99.0)),
            "stretch": self._stretch(found),
            "stretch_full": self._stretch(full),
            "normals_mean": float(angle.mean()),
            "normals_p99": float(np.percentile(angle, 99.0)),
        }

    def _stretch(self, vertices: Floats) -> float:
        return float(np.percentile(self._edges.stretch(vertices), 99.0))

    def _normals(self, vertices: Floats) -> Floats:
        a, b, c = (vertices[self._faces[:, corner]] for corner in range(3))
        of_face = np.cross(b - a, c - a)
        normals = np.zeros_like(vertices)
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(
                    self._faces[:, corner], of_face[:, axis], minlength=len(vertices)
                )
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.asarray(normals / np.maximum(lengths, 1e-300))


def _over_all(figures: Sequence[Figures]) -> Figures:
    """Return the root mean square of each figure; empty without comparisons."""
    if not figures:
        return {}
    return {
        name: float(np.sqrt(np.mean([frame[name] ** 2 for frame in figures])))
        for name in figures[0]
    }
