"""Unions of surfaces: closed, free of crossings, even at the seam, and what is carried over."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from solvers.editing.surface.self_crossing import crosses_itself
from solvers.editing.surface.sheet import Derived, Sheet
from tests.solvers.editing.surface.solids import (
    crossing_pairs,
    is_watertight,
    placed,
    texture_of,
    together,
    torus,
    tube,
    volume,
)

pytest.importorskip("manifold3d")
from solvers.editing.surface.surface_union import united

shifts = st.tuples(*(st.floats(-0.06, 0.06) for _ in range(3)))


def lying(sheet: Sheet, angles: tuple[float, float, float] = (1.57, 0.1, 0.2)) -> Sheet:
    turned = Rotation.from_euler("xyz", angles).apply(sheet.vertices)
    return Sheet(turned, sheet.vertex, sheet.faces)


def across_the_middle(radius: float = 0.06) -> Sheet:
    """A thinner tube that leaves the first one at its middle."""
    return placed(lying(tube(14, 17, radius)), (0.01, 0.02, 0.5))


def volume_of_union(base: Sheet, graft: Sheet) -> float:
    solids = [
        trimesh.Trimesh(each.vertices, each.triangles, process=False) for each in (base, graft)
    ]
    return float(trimesh.boolean.union(solids, engine="manifold").volume)


def near_seam(whole: Derived) -> np.ndarray:
    chosen: np.ndarray = whole.seam[whole.sheet.triangles].any(axis=1)
    return chosen


@example(shift=(0.0546875, -0.0546875, 0.0), turn=(1.5, 0.0, 1.0))
@example(shift=(0.0546875, -0.0546875, 0.0), turn=(2.0, 0.0, 1.0))
@given(shift=shifts, turn=st.tuples(*(st.floats(0.0, 3.0) for _ in range(3))))
def test_a_union_is_closed_and_does_not_cross_itself(
    shift: tuple[float, float, float], turn: tuple[float, float, float]
) -> None:
    base = tube(8, 6)
    graft = placed(lying(tube(7, 6, 0.07), turn), (shift[0], shift[1], 0.5 + shift[2]))
    whole = united(base, graft)
    assert is_watertight(whole.sheet)
    assert crossing_pairs(whole.sheet, near_seam(whole)) == 0
    exact = volume_of_union(base, graft)
    assert 0.97 * exact < volume(whole.sheet) < 1.1 * exact
    for shares in (whole.of_vertices, whole.of_copies):
        assert_allclose(shares.sum(axis=1), 1.0, atol=1e-9)
        assert shares.data.min() >= 0.0


def test_the_seam_has_no_slivers() -> None:
    whole = united(tube(), across_the_middle())
    corners = whole.sheet.vertices[whole.sheet.triangles[near_seam(whole)]]
    sides = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(sides, axis=2)
    units = sides / lengths[:, :, None]
    cosines = -(units * np.roll(units, 1, axis=1)).sum(axis=2)
    assert np.degrees(np.arccos(cosines.max())) > 10.0
    assert lengths.min() > 0.25 * np.median(lengths)


def test_beyond_the_seam_all_stays_as_it_was() -> None:
    both = together(tube(), across_the_middle())
    whole = united(tube(), across_the_middle())
    far = ~whole.seam
    assert far.sum() > 300
    made_of = whole.of_vertices[far]
    assert_array_equal(np.diff(made_of.indptr), 1)
    assert_allclose((whole.of_vertices @ both.vertices)[far], whole.sheet.vertices[far], atol=1e-12)


def test_copies_keep_the_look_of_the_part_that_they_are_of() -> None:
    base, graft = tube(), across_the_middle()
    whole = united(base, graft)
    part = np.repeat([0.0, 1.0], [len(base.vertex), len(graft.vertex)])
    carried = (whole.of_copies @ part)[whole.sheet.faces]
    assert_allclose(carried, np.repeat((whole.of_faces >= len(base.faces))[:, None], 3, axis=1))
    texture = np.concatenate([texture_of(base), texture_of(graft, 14)])
    tips = [len(base.vertex) - 2, len(base.vertex) - 1, len(part) - 2, len(part) - 1]
    on_end = np.isin(together(base, graft).faces, tips).any(axis=1)[whole.of_faces]
    shown = (whole.of_copies @ texture)[whole.sheet.faces, 0]
    assert np.ptp(shown[~on_end], axis=1).max() < 0.25  # no smear from 1 to 0


def test_what_vertices_carry_blends_across_the_seam() -> None:
    base, graft = tube(), across_the_middle()
    whole = united(base, graft)
    share = whole.of_vertices @ np.repeat([0.0, 1.0], [len(base.vertices), len(graft.vertices)])
    edges = whole.sheet.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert np.abs(np.diff(share[edges], axis=1)).max() < 0.5
    assert 0.0 == share.min() < share.max() == 1.0


def test_what_cannot_be_united_says_why_in_one_line() -> None:
    with pytest.raises(ValueError, match="graft is no closed surface"):
        united(tube(), tube(ends=False))
    with pytest.raises(ValueError, match="do not meet"):
        united(tube(), placed(tube(), (3.0, 0.0, 0.0)))
    with pytest.raises(ValueError, match="inside the other"):
        united(tube(), placed(tube(), (0.0, 0.0, 0.5), 0.01))


def test_crossings_are_found_as_an_independent_check_finds_them() -> None:
    base = torus(14, 8)
    every = np.ones(2 * len(base.faces), dtype=np.bool_)
    for shift, crosses in ((0.4, True), (2.2, True), (2.7, False)):
        both = together(base, placed(base, (shift, 0.05, 0.1)))
        assert crosses_itself(both.vertices, both.triangles, every) == crosses
        assert (crossing_pairs(both, every) > 0) == crosses
