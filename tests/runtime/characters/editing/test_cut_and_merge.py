"""Whole characters are cut and merged: their nodes, their looks, and what moves their skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.character import Character, Material, Surface
from runtime.characters.editing.carried import sheet_of
from runtime.characters.editing.cutting import cut_across, cut_along
from runtime.characters.editing.merging import merge
from runtime.characters.morphs import Morphs
from solvers.deform.morph_targets import MorphTargets
from solvers.editing.surface.blade import drawn
from tests.solvers.editing.surface.solids import is_watertight, placed, texture_of, tube

HALF = ("root", "middle", "tip")


def limb(shift: tuple[float, float, float] = (0.0, 0.0, 0.0), ends: bool = True) -> Character:
    """A tube with three nodes along it, coloured and textured by height, with one morph target."""
    sheet = placed(tube(ends=ends), shift)
    height = sheet.vertices[:, 2] - shift[2]
    share = np.clip(2.0 * height - 0.5, 0.0, 1.0)
    copies = height[sheet.vertex]
    targets = MorphTargets.of([(np.arange(len(height)), height[:, None] * [1.0, 0.0, 0.0])])
    return Character(
        name="limb",
        vertices=sheet.vertices,
        faces=sheet.triangles,
        skeleton=Skeleton(
            HALF, np.array([-1, 0, 1]), np.add(shift, [[0, 0, 0.02], [0, 0, 0.5], [0, 0, 0.98]])
        ),
        weights=csr_array(np.stack([1.0 - share, share, 0.0 * share], axis=1)),
        surface=Surface(
            sheet.vertex,
            sheet.faces.astype(np.int32),
            np.stack([copies, 0 * copies, 0 * copies, 1 + 0 * copies], 1).astype(np.float32),
            texture_of(tube(ends=ends)).astype(np.float32),
            (Material(np.ones(4, np.float32)), Material(np.zeros(4, np.float32))),
            (np.arange(len(sheet.faces)) % 2).astype(np.int64),
        ),
        file_to_stage=np.eye(4),
        morphs=Morphs.of(targets, ["grow"]),
    )


def test_a_cut_parts_nodes_and_carries_colours_weights_and_morphs() -> None:
    whole = limb()
    kept, off = cut_across(whole, 2, 0.3)
    at = 0.5 + 0.3 * 0.48
    assert kept.skeleton.names == ("root", "middle", "tip cut")
    assert off.skeleton.names == ("tip", "tip cut")
    assert kept.skeleton.parents.tolist() == [-1, 0, 1]
    assert off.skeleton.parents.tolist() == [1, -1]
    for piece in (kept, off):
        assert is_watertight(sheet_of(piece))
        assert_allclose(piece.skeleton.rest_positions[-1], [0.0, 0.0, at])
        assert piece.weights is not None
        assert_allclose(piece.weights.sum(axis=1), 1.0)
        assert_allclose(
            piece.surface.colors[:, 0], piece.vertices[piece.surface.vertex, 2], atol=1e-6
        )
        assert piece.morphs is not None
        assert_allclose(
            piece.morphs.targets.deltas[:, 0], piece.vertices[piece.morphs.targets.vertices, 2]
        )
        assert len(piece.surface.face_material) == len(piece.faces)
    assert off.weights is not None
    assert_allclose(off.weights[:, [1]].toarray(), 1.0)  # it hung on the bone that is cut


def test_a_drawn_line_cuts_where_it_crosses_the_bone() -> None:
    line = [[-0.2, 0, 0.6], [0.0, 0, 0.8], [0.2, 0, 0.6]]
    kept, off = cut_along(limb(), 2, drawn(line, (0.0, 1.0, 0.0)))
    assert_allclose(off.skeleton.rest_positions[-1], [0.0, 0.0, 0.8], atol=1e-3)
    assert kept.vertices[:, 2].max() < 0.81
    assert is_watertight(sheet_of(kept))


def test_a_merge_hangs_the_graft_on_the_node_and_blends_the_skin_at_the_seam_only() -> None:
    pytest.importorskip("manifold3d")
    base, graft = limb(), limb((0.03, 0.01, 0.7))
    whole = merge(base, graft, 2)
    assert whole.skeleton.names == (*HALF, "root 2", "middle 2", "tip 2")
    assert whole.skeleton.parents.tolist() == [-1, 0, 1, 2, 3, 4]
    assert is_watertight(sheet_of(whole))
    assert len(whole.surface.materials) == 4
    assert set(np.unique(whole.surface.face_material)) == {0, 1, 2, 3}
    assert whole.weights is not None
    weights = whole.weights.toarray()
    assert_allclose(weights.sum(axis=1), 1.0)
    low, high = whole.vertices[:, 2] < 0.4, whole.vertices[:, 2] > 1.3
    assert low.any()
    assert high.any()
    assert (weights[low, 3:] == 0.0).all()
    assert (weights[high, :3] == 0.0).all()
    mixed = (weights[:, :3].sum(axis=1) > 0.05) & (weights[:, 3:].sum(axis=1) > 0.05)
    assert mixed.any()
    assert whole.morphs is not None
    assert whole.morphs.names == ("grow", "grow")


def test_what_was_cut_off_is_merged_on_again() -> None:
    pytest.importorskip("manifold3d")
    kept, off = cut_across(limb(), 2, 0.3)
    sunk = replace(off, vertices=off.vertices - [0.0, 0.0, 0.02])
    whole = merge(kept, sunk, 2)
    assert whole.skeleton.names == ("root", "middle", "tip cut", "tip")
    assert whole.skeleton.parents.tolist() == [-1, 0, 1, 2]
    assert is_watertight(sheet_of(whole))
    assert_allclose(np.ptp(whole.vertices[:, 2]), 0.98)


def test_what_cannot_be_done_says_so_in_one_line() -> None:
    with pytest.raises(InputError, match="no bone that ends at node 0"):
        cut_across(limb(), 0, 0.5)
    with pytest.raises(InputError, match="between 0 and 1"):
        cut_across(limb(), 1, 1.0)
    with pytest.raises(InputError, match="cannot cut limb before middle: the line does not cross"):
        cut_along(limb(), 1, drawn([[-1, 0, 5], [1, 0, 5]], (0.0, 1.0, 0.0)))
    with pytest.raises(InputError, match="no node 7"):
        merge(limb(), limb(), 7)
    with pytest.raises(InputError, match="only one of them"):
        merge(limb(), replace(limb(), weights=None), 1)
    pytest.importorskip("manifold3d")
    with pytest.raises(InputError, match="cannot merge limb onto limb: the graft is no closed"):
        merge(limb(), limb(ends=False), 1)
