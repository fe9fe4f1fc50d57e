from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from runtime.output.report import watchdog
from runtime.output.report.report import Report
from runtime.output.report.watchdog import Finding, Watchdog
from solvers.signal.streaming_median import StreamingMedian
from solvers.surface.edges import Edges
from tests.runtime.tentacle import make_show, make_tentacle


def sheet(side: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A flat square of unit cells in the plane z = 0."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1).astype(float)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [np.stack([a, a + 1, a + side + 1], 1), np.stack([a, a + side + 1, a + side], 1)]
    )
    return vertices, faces


class Watched:
    """A surface with a watchdog, who is told how its edges stretch."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.dog = Watchdog(vertices, faces)
        self._edges = Edges.of(vertices, faces)

    def add(self, deformed: np.ndarray) -> Finding:
        self.dog.add(deformed, self._edges.stretch(deformed))
        assert self.dog.last is not None
        return self.dog.last


def look(vertices: np.ndarray, faces: np.ndarray, deformed: np.ndarray) -> Finding:
    return Watched(vertices, faces).add(deformed)


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.sampled_from([1e-3, 1.0, 1e3]))
def test_a_rigid_motion_is_in_order_at_any_scale(seed: int, scale: float) -> None:
    character = make_tentacle()
    turn = Rotation.random(rng=np.random.default_rng(seed))
    rest = scale * character.vertices
    found = look(rest, character.faces, turn.apply(rest) + 5 * scale)
    assert found.energy < 1e-12
    assert found.stretch_max < 1e-9
    assert found.inverted == found.longest == 0


@settings(deadline=None)
@given(x=st.floats(0.3, 3.0), y=st.floats(0.3, 3.0))
def test_energy_of_a_stretch_is_the_sum_of_squared_strains(x: float, y: float) -> None:
    vertices, faces = sheet()
    found = look(vertices, faces, vertices * [x, y, 1.0])
    assert found.energy == pytest.approx((x - 1) ** 2 + (y - 1) ** 2, abs=1e-9)
    assert found.stretch_max == pytest.approx(max(abs(x - 1), abs(y - 1)), abs=1e-9)
    assert found.inverted == 0


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.1, 0.9))
def test_in_the_plane_inverted_is_what_lies_face_down(seed: int, share: float) -> None:
    vertices, faces = sheet()
    rng = np.random.default_rng(seed)
    moved = vertices.copy()
    lone = 12 * np.arange(2, 10, 4)[:, None] + np.arange(2, 10, 4)  # no two in one triangle
    chosen = lone.ravel()[rng.random(lone.size) < share]
    moved[chosen, :2] += 1.7 * rng.normal(size=(len(chosen), 2))
    a, b, c = (moved[faces[:, k]] for k in range(3))
    height = np.cross(b - a, c - a)[:, 2]
    longest = max(np.linalg.norm(s, axis=1).max() for s in (b - a, c - b, a - c))
    clear = abs(height) > 2.0 * watchdog.SLIVER * longest**2
    turn = Rotation.random(rng=rng)
    found = look(vertices, faces, turn.apply(moved))
    assert ((height < 0) & clear).sum() <= found.inverted <= (height < 0).sum()


def test_a_sharp_bend_is_not_inverted_but_a_fold_against_the_ring_is() -> None:
    vertices, faces = sheet()
    angle = np.clip(vertices[:, 0] - 4.0, 0.0, 3.0)  # three radians over three cells
    x = np.cumsum(np.r_[0.0, np.cos(np.clip(np.arange(0.5, 11.0) - 4.0, 0.0, 3.0))])
    z = np.cumsum(np.r_[0.0, np.sin(np.clip(np.arange(0.5, 11.0) - 4.0, 0.0, 3.0))])
    column = vertices[:, 0].astype(int)
    bent = np.stack([x[column], vertices[:, 1], z[column]], axis=1)
    assert angle.max() == 3.0
    assert look(vertices, faces, bent).inverted == 0
    folded = bent.copy()
    folded[12 * 6 + 2] += [0.0, 1.8, 0.0]
    assert look(vertices, faces, folded).inverted > 0


def test_slivers_are_never_inverted() -> None:
    vertices, faces = sheet()
    middle = (vertices[60] + vertices[61]) / 2 + [0.0, 1e-3, 0.0]
    points = np.vstack([vertices, middle])
    needles = np.vstack([faces, [[60, 61, 144]]])
    moved = points.copy()
    moved[144] -= [0.0, 2e-3, 0.0]
    assert look(points, needles, moved).inverted == 0


def test_runs_are_those_of_one_triangle() -> None:
    vertices, faces = sheet()
    watched = Watched(vertices, faces)

    def folded(*corners: int) -> np.ndarray:
        moved = vertices.copy()
        moved[list(corners)] += [1.4, 1.4, 0.0]
        return moved

    for corners in ((39,), (39,), (), (39,), (39, 90), (90,), (90,), ()):
        watched.add(folded(*corners))
    inverted = watched.dog.summary()["inverted"]
    assert inverted["longest"] == 3
    assert inverted["frames"] == 6
    assert inverted["last"] == 0
    assert inverted["max"] == look(vertices, faces, folded(39, 90)).inverted


def test_a_large_surface_is_looked_at_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdog, "EACH_FRAME", 60)  # of 144 vertices: every third frame
    vertices, faces = sheet()
    watched = Watched(vertices, faces)
    folded = vertices.copy()
    folded[39] += [1.4, 1.4, 0.0]
    for frame in range(12):
        watched.add(folded if frame >= 6 else vertices)
    inverted = watched.dog.summary()["inverted"]
    assert inverted["longest"] == 6
    assert inverted["frames"] == 6


def test_the_report_holds_the_worst_of_the_show() -> None:
    character = make_tentacle()
    report = Report(None)
    part = report.cast(character)
    watched = Watched(character.vertices, character.faces)
    found = []
    for frame in make_show(character, frames=10):
        part.write(frame)
        found.append(watched.add(frame.vertices))
    said = report.summary()["watchdog"]
    assert said["energy"]["max"] == max(one.energy for one in found)
    assert said["energy"]["p50"] == pytest.approx(np.median([one.energy for one in found]), rel=0.1)
    assert said["stretch"]["max"] == max(one.stretch_max for one in found)
    assert said["stretch"]["p99"] == max(one.stretch_p99 for one in found)
    assert set(said["inverted"]) == {"max", "last", "longest", "frames"}


def test_no_faces_and_no_frames_are_in_order() -> None:
    nothing = np.zeros((0, 3), np.int64)
    watched = Watched(np.eye(3), nothing)
    assert watched.dog.summary()["energy"] == {"p50": 0.0, "max": 0.0}
    assert watched.add(np.eye(3)) == Finding(0.0, 0.0, 0.0, 0, 0)


def test_what_tears_is_infinite() -> None:
    vertices, faces = sheet()
    torn = vertices.copy()
    torn[5] = np.nan
    assert look(vertices, faces, torn).stretch_max == np.inf


@given(values=st.lists(st.floats(1e-9, 1e3), min_size=1, max_size=40))
def test_the_median_is_near(values: list[float]) -> None:
    histogram = StreamingMedian()
    for value in values:
        histogram.add(value)
    lower = np.percentile(values, 50, method="inverted_cdf")
    assert histogram.median == pytest.approx(lower, rel=0.05)


def test_the_median_of_nothing_and_of_what_no_bin_holds() -> None:
    assert StreamingMedian().median == 0.0
    histogram = StreamingMedian()
    histogram.add(0.0)
    assert histogram.median == 0.0
    for value in (np.inf, np.nan, 1e300):
        histogram.add(value)
    assert histogram.median == pytest.approx(1e6, rel=0.05)
