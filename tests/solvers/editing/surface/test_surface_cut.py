"""Cuts through surfaces: what stays whole, what is closed, and what is carried over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from solvers.editing.surface.blade import Blade, drawn, plane
from solvers.editing.surface.sheet import Derived, Sheet
from solvers.editing.surface.surface_cut import across, cut_surface, share_of
from tests.solvers.editing.surface.solids import (
    crossing_pairs,
    inside_out,
    is_watertight,
    placed,
    texture_of,
    together,
    torus,
    tube,
    volume,
)

tilts = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
MIDDLE = (0.0, 0.0, 0.5)


def wave(height: float = 0.05) -> Blade:
    """A drawn line that rises and falls across the tube, seen along y."""
    x = np.linspace(-0.2, 0.2, 15)
    line = np.stack([x, 0.0 * x, 0.5 + height * np.cos(20.0 * x)], axis=1)
    return drawn(line, (0.0, 1.0, 0.0)).towards((0.0, 0.0, 1.0))


def check_closed(piece: Derived, sheet: Sheet) -> None:
    assert is_watertight(piece.sheet)
    assert crossing_pairs(piece.sheet, piece.seam[piece.sheet.triangles].any(axis=1)) == 0
    for shares in (piece.of_vertices, piece.of_copies):
        assert_allclose(shares.sum(axis=1), 1.0, atol=1e-12)
        assert shares.data.min() >= 0.0
    kept = ~piece.seam
    assert_allclose((piece.of_vertices @ sheet.vertices)[kept], piece.sheet.vertices[kept])


@given(tilt=tilts, height=st.one_of(st.floats(0.2, 0.8), st.sampled_from([0.25, 0.5, 0.55])))
def test_a_plane_cuts_a_closed_surface_into_two_closed_ones(
    tilt: tuple[float, float], height: float
) -> None:
    sheet = tube(10, 9)
    kept, off = cut_surface(sheet, plane((0, 0, height), (*tilt, 1.0)), (0.0, 0.0, height))
    for piece in (kept, off):
        check_closed(piece, sheet)
        assert volume(piece.sheet) > 0.0
    assert_allclose(volume(kept.sheet) + volume(off.sheet), volume(sheet), rtol=0.01)
    blade = plane((0, 0, height), (*tilt, 1.0))
    assert blade.side(kept.sheet.vertices).max() < 1e-9
    assert blade.side(off.sheet.vertices).min() > -1e-9


def test_a_cut_across_whole_edges_loses_no_volume() -> None:
    sheet = tube()
    kept, off = cut_surface(sheet, across((0, 0, 0), (0, 0, 1), 0.53), (0.0, 0.0, 0.53))
    assert_allclose(volume(kept.sheet), 0.53 * volume(sheet), rtol=1e-12)
    assert_allclose(volume(off.sheet), 0.47 * volume(sheet), rtol=1e-12)


def test_a_drawn_line_cuts_a_curved_face_on_both_sides() -> None:
    sheet, blade = tube(), wave()
    at = share_of(blade, (0, 0, 0), (0, 0, 1))
    assert_allclose(at, 0.55, atol=1e-3)
    kept, off = cut_surface(sheet, blade, (0.0, 0.0, at))
    for piece, sign in ((kept, 1.0), (off, -1.0)):
        check_closed(piece, sheet)
        assert (sign * blade.side(piece.sheet.vertices)).max() < 1e-9
    assert_allclose(volume(kept.sheet) + volume(off.sheet), volume(sheet), rtol=0.01)
    assert np.ptp(kept.sheet.vertices[kept.seam, 2]) > 0.05  # the face is not plane


def test_a_cap_has_edges_as_long_as_those_beside_it() -> None:
    kept, _ = cut_surface(tube(32, 60), across((0, 0, 0), (0, 0, 1), 0.5), MIDDLE)
    triangles = kept.sheet.triangles
    corners = kept.sheet.vertices[triangles]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    cap = kept.seam[triangles].all(axis=1)
    beside = kept.seam[triangles].any(axis=1) & ~cap
    assert cap.sum() > 60
    assert 0.6 < np.median(lengths[cap]) / np.median(lengths[beside]) < 1.6
    assert lengths[cap].max() < 2.5 * np.median(lengths[beside])


def test_another_limb_that_the_plane_goes_through_stays_whole() -> None:
    legs = together(tube(), placed(tube(), (0.3, 0.0, 0.0)))
    kept, off = cut_surface(legs, across((0, 0, 0), (0, 0, 1), 0.53), MIDDLE)
    assert_allclose(volume(kept.sheet), 1.53 * volume(tube()), rtol=1e-12)
    assert off.sheet.vertices[:, 0].max() < 0.11


def test_a_sleeve_is_cut_with_its_lining_and_buttons_go_with_what_is_near() -> None:
    lining = inside_out(tube(16, 21, 0.11))
    button = placed(tube(8, 5, 0.2), (0.14, 0.0, 0.7), 0.02)
    dressed = together(tube(), tube(16, 21, 0.13), lining, button)
    kept, off = cut_surface(dressed, across((0, 0, 0), (0, 0, 1), 0.53), MIDDLE)
    assert is_watertight(kept.sheet)
    assert is_watertight(off.sheet)
    solid = volume(dressed) - volume(button)
    assert_allclose(volume(kept.sheet), 0.53 * solid, rtol=1e-9)
    assert_allclose(volume(off.sheet), 0.47 * solid + volume(button), rtol=1e-9)


def test_what_vertices_and_copies_carry_goes_on_without_smears_across_the_seam() -> None:
    sheet = tube()
    texture = texture_of(sheet)
    for piece in cut_surface(sheet, plane(MIDDLE, (0.3, 0.2, 1.0)), MIDDLE):
        carried = piece.of_copies @ texture
        cap = piece.seam[piece.sheet.triangles].all(axis=1)
        sides = np.unique(piece.sheet.faces[~cap])
        height = piece.sheet.vertices[piece.sheet.vertex, 2]
        assert_allclose(carried[sides, 1], height[sides], atol=0.003)
        tip = np.isin(sheet.faces, [len(sheet.vertex) - 1, len(sheet.vertex) - 2]).any(axis=1)
        shown = carried[piece.sheet.faces[~tip[piece.of_faces]], 0]
        assert np.ptp(shown[~cap[~tip[piece.of_faces]]], axis=1).max() < 0.1
        rim = carried[np.unique(piece.sheet.faces[cap])]
        assert rim[:, 1].min() > 0.4
        weights = piece.of_vertices @ sheet.vertices[:, 2]
        assert_allclose(weights[piece.seam], piece.sheet.vertices[piece.seam, 2], atol=0.03)
        assert (np.diff(piece.of_vertices.indptr) > 0).all()


def test_open_ends_stay_open_and_the_cut_is_closed() -> None:
    kept, off = cut_surface(tube(ends=False), across((0, 0, 0), (0, 0, 1), 0.53), MIDDLE)
    for piece, end in ((kept, 0.0), (off, 1.0)):
        triangles = piece.sheet.triangles
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        border, count = np.unique(edges, axis=0, return_counts=True)
        assert count.max() == 2
        assert (piece.sheet.vertices[border[count == 1], 2] == end).all()


def test_an_open_sheet_is_parted_without_a_cap() -> None:
    whole = tube(ends=False)
    half = Sheet(
        whole.vertices,
        whole.vertex,
        whole.faces[whole.vertices[whole.triangles, 1].min(1) >= -1e-9],
    )
    kept, off = cut_surface(half, across((0, 0, 0), (0, 0, 1), 0.53), MIDDLE)
    assert not kept.seam.any()
    assert_allclose(kept.sheet.vertices[:, 2].max(), 0.53)
    assert_allclose(off.sheet.vertices[:, 2].min(), 0.53)


def test_what_cannot_be_cut_says_why_in_one_line() -> None:
    ring = torus()
    with pytest.raises(ValueError, match="hangs together"):
        cut_surface(ring, plane((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="goes past"):
        cut_surface(tube(), plane((0, 0, 2.0), (0, 0, 1)), (0.0, 0.0, 2.0))
    thrice = Sheet(
        tube().vertices, tube().vertex, np.concatenate([tube().faces, tube().faces[160:176]])
    )
    with pytest.raises(ValueError, match="more than two"):
        cut_surface(thrice, across((0, 0, 0), (0, 0, 1), 0.53), MIDDLE)
    turned = tube()
    turned.faces[160:170] = turned.faces[160:170, ::-1]
    with pytest.raises(ValueError, match="inside out"):
        cut_surface(turned, plane(MIDDLE, (0.3, 0.2, 1.0)), MIDDLE)
    with pytest.raises(ValueError, match="crosses itself"):
        drawn([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0.5, 0, -1]], (0, 1, 0))
    with pytest.raises(ValueError, match="does not cross"):
        share_of(wave(), (0, 0, 0), (0, 0, 0.3))
