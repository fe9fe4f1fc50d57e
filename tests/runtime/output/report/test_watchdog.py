"""The watchdog: energy, stretch and inverted triangles of a performance."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.output.report import watchdog
from runtime.output.report.report import Report
from runtime.output.report.watchdog import Finding, Watchdog
from solvers.surface.edges import Edges
from tests.runtime.tentacle import make_show, make_tentacle
from tests.solvers.surface.test_surface_quality import sheet


class Watched:
    """A surface with its watchdog and the stretch of its edges."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.dog = Watchdog(vertices, faces)
        self._edges = Edges.of(vertices, faces)

    def add(self, deformed: np.ndarray) -> Finding:
        self.dog.add(deformed, self._edges.stretch(deformed))
        assert self.dog.last is not None
        return self.dog.last


def look(vertices: np.ndarray, faces: np.ndarray, deformed: np.ndarray) -> Finding:
    return Watched(vertices, faces).add(deformed)


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
    part = report.add_character(character)
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
