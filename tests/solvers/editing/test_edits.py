"""Edits of random animated parts: what they must keep, at every time, and to how many digits."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from solvers.editing.bending import bent
from solvers.editing.clips_on_chains import (
    LaidClip,
    clips_on,
    parameters_at,
    with_clip,
    without_clip,
)
from solvers.editing.cutting import branch_of, cut, without_branch
from solvers.editing.merging import merged
from solvers.editing.motion import Clip
from solvers.editing.nodes import with_node, with_tip, without_node
from solvers.editing.part import Part, part_of
from solvers.editing.part_pose import modelled_pose, pose_at
from solvers.editing.placing import delayed, mirrored, moved, scaled, turned
from solvers.editing.rerooting import rerooted
from tests.solvers.editing.shapes import (
    TIMES,
    angle,
    apart,
    some_bone,
    some_motion,
    some_part,
    some_quaternion,
)

seeds = st.integers(0, 2**32 - 1)
times = st.floats(-1.0, 5.0)
shares = st.floats(0.02, 0.98)


@given(seed=seeds, share=shares)
def test_a_node_that_is_added_and_removed_leaves_the_same_bits(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone = some_bone(random, part)
    new = part.next_id
    assert without_node(with_node(part, bone, share), new) == part


@given(seed=seeds, first=shares, second=shares)
def test_two_nodes_added_and_removed_in_either_order_leave_the_same_bits(
    seed: int, first: float, second: float
) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone, new = some_bone(random, part), part.next_id
    added = with_node(with_node(part, bone, first), bone, second)
    assert without_node(without_node(added, new), new + 1) == part
    assert without_node(without_node(added, new + 1), new) == part


@given(seed=seeds, share=shares, time=times)
def test_nodes_do_not_change_the_total_turning(seed: int, share: float, time: float) -> None:
    """Added or removed: every bone but the one beside the node has the rotation it had."""
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone = some_bone(random, part)
    assert apart(part, with_node(part, bone, share), time)[0] < 1e-9
    inner = [node.id for node in part.nodes[1:] if part.children(node.id)]
    if inner:
        assert apart(part, without_node(part, inner[seed % len(inner)]), time)[0] < 1e-9


@given(seed=seeds, share=st.floats(0.0, 0.98), time=times)
def test_a_cut_is_not_seen_at_its_time_and_the_kept_part_never_sees_it(
    seed: int, share: float, time: float
) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    kept, off = cut(part, some_bone(random, part), share, time)
    for piece in (kept, off):
        assert max(apart(part, piece, time)) < 1e-9
    assert len(kept) + len(off) == len(part) + (2 if share > 0.0 else 1)
    for other in TIMES:
        assert max(apart(part, kept, other)) < 1e-9


@given(seed=seeds, share=shares, time=times)
def test_both_pieces_of_a_cut_bone_turn_as_it_did_at_every_time(
    seed: int, share: float, time: float
) -> None:
    """Against the bone before it, which stands still for what came off."""
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone = some_bone(random, part)
    kept, off = cut(part, bone, share, time)
    before = part.node(bone).parent
    for other in TIMES:
        whole, one, two = (pose_at(each, other) for each in (part, kept, off))
        turn = Rotation.from_quat(whole.rotation(before)).inv()
        wanted = (turn * Rotation.from_quat(whole.rotation(bone))).as_quat()
        still = Rotation.from_quat(two.rotation(part.next_id)).inv()
        assert angle(wanted, (still * Rotation.from_quat(two.rotation(bone))).as_quat()) < 1e-9
        assert angle(whole.rotation(bone), one.rotation(part.next_id)) < 1e-9


@given(seed=seeds, share=st.floats(0.0, 0.98), time=times)
def test_a_cut_that_is_merged_again_restores_the_motion_at_every_time(
    seed: int, share: float, time: float
) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone = some_bone(random, part)
    kept, off = cut(part, bone, share, time)
    seam = part.next_id if share > 0.0 else part.node(bone).parent
    again = merged(kept, off, seam, time)
    for other in TIMES:
        assert max(apart(part, again, other)) < 1e-9
    if share > 0.0:
        healed = without_node(again, seam)
        for other in TIMES:
            assert max(apart(part, healed, other)) < 1e-9
        assert healed.node(bone).bone.stem == part.node(bone).bone.stem


@given(seed=seeds, time=times)
def test_a_merge_is_not_seen_at_its_time(seed: int, time: float) -> None:
    """Wherever the graft is, and however it is turned; its motion goes on."""
    random = np.random.default_rng(seed)
    base, graft = some_part(random, 6), some_part(random, 5)
    graft = turned(moved(graft, (1.0, 2.0, 3.0)), some_quaternion(random), (0.0, 1.0, 0.0))
    node = base.nodes[int(random.integers(0, len(base)))].id
    whole = merged(base, graft, node, time)
    assert max(apart(base, whole, time)) < 1e-9
    as_seen, new = pose_at(graft, time), pose_at(whole, time)
    assert len(whole) == 11
    for row, at in enumerate(whole.index.values()):
        if row >= 6:
            assert angle(new.rotations[at], as_seen.rotations[row - 6]) < 1e-9 or row == 6
            assert_allclose(new.positions[at], as_seen.positions[row - 6], atol=1e-9)
    for other in TIMES:
        then, graft_then = pose_at(whole, other), pose_at(graft, other)
        hub = Rotation.from_quat(then.rotation(node))
        stood = Rotation.from_quat(new.rotation(node))
        for row in range(7, 11):
            wanted = hub * stood.inv() * Rotation.from_quat(graft_then.rotations[row - 6])
            assert angle(then.rotations[row], wanted.as_quat()) < 1e-9


def test_a_graft_whose_root_is_on_the_node_becomes_one_with_it() -> None:
    random = np.random.default_rng(4)
    base = some_part(random, 4)
    place = pose_at(base, 0.7).position(2)
    graft = part_of(place + random.normal(size=(3, 3)), np.array([-1, 0, 1]))
    graft = moved(graft, tuple((place - graft.place).tolist()))
    whole = merged(base, graft, 2, 0.7)
    assert [(node.id, node.parent) for node in whole.nodes[4:]] == [(4, 2), (5, 4)]


@given(seed=seeds, time=times)
def test_another_root_changes_no_rotation_at_any_time(seed: int, time: float) -> None:
    """Bones that change direction have their other end; all others keep theirs."""
    random = np.random.default_rng(seed)
    part = some_part(random)
    node = some_bone(random, part)
    other = rerooted(part, node, time)
    assert other.root.id == node
    way = part.path(node)
    turned_over = {end.id: start.id for start, end in pairwise(way)}
    for then in TIMES:
        before, after = pose_at(part, then), pose_at(other, then)
        for each in part.nodes[1:]:
            now = turned_over.get(each.id, each.id)
            assert angle(before.rotation(each.id), after.rotation(now)) < 1e-9
    assert_allclose(pose_at(other, time).positions[0], pose_at(part, time).position(node))
    back = rerooted(other, part.root.id, time)
    for then in TIMES:
        first, second = pose_at(part, then), pose_at(back, then)
        for each in part.nodes[1:]:
            assert angle(first.rotation(each.id), second.rotation(each.id)) < 1e-9


def test_the_root_that_was_before_is_restored_without_a_rest() -> None:
    part = some_part(np.random.default_rng(11), 7, clips=2)
    back = rerooted(rerooted(part, 6, 0.0), part.root.id, 0.0)
    for node in part.nodes:
        assert len(back.node(node.id).bone.turns) <= 2


@given(seed=seeds, time=times, factor=st.floats(0.1, 10.0))
def test_placing_moves_every_node_as_it_moves_the_world(
    seed: int, time: float, factor: float
) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    before = pose_at(part, time)
    rotation, pivot = some_quaternion(random), tuple(random.normal(size=3).tolist())
    spin = Rotation.from_quat(rotation)
    after = pose_at(turned(part, rotation, pivot), time)
    assert_allclose(after.positions, spin.apply(before.positions - pivot) + pivot, atol=1e-9)
    after = pose_at(scaled(part, factor, pivot), time)
    assert_allclose(
        after.positions, factor * (before.positions - pivot) + pivot, atol=1e-9 * max(factor, 1.0)
    )
    normal = random.normal(size=3)
    unit = normal / np.linalg.norm(normal)
    after = pose_at(mirrored(part, pivot, normal), time)
    images = before.positions - 2.0 * np.outer((before.positions - pivot) @ unit, unit)
    assert_allclose(after.positions, images, atol=1e-9)


@given(seed=seeds, time=times)
def test_a_bone_that_is_bent_turns_as_asked_and_keeps_its_motion(seed: int, time: float) -> None:
    random = np.random.default_rng(seed)
    part = some_part(random)
    bone, rotation = some_bone(random, part), some_quaternion(random)
    posed = bent(part, bone, rotation, time)
    before, after = pose_at(part, time), pose_at(posed, time)
    for node in part.branch(bone):
        wanted = Rotation.from_quat(rotation) * Rotation.from_quat(before.rotation(node.id))
        assert angle(after.rotation(node.id), wanted.as_quat()) < 1e-9
    back = bent(posed, bone, (-rotation[0], -rotation[1], -rotation[2], rotation[3]), time)
    for other in TIMES:
        assert apart(part, back, other)[0] < 1e-9


def graft_of_figure_13() -> tuple[Part, Clip, Clip]:
    """Two bones with a clip each, merged at node 1: (orange, 0.6) ends and (cyan, 0.3) begins."""
    random = np.random.default_rng(5)
    orange, cyan = (Clip(some_motion(random)) for _ in range(2))
    line = np.array([[0.0, 0, 0], [2, 0, 0]])
    base = with_clip(part_of(line, np.array([-1, 0])), (0, 1), LaidClip(orange, 0.0, 0.6))
    other = with_clip(part_of(line[::-1], np.array([-1, 0])), (0, 1), LaidClip(cyan, 0.3, 1.0))
    there = moved(other, tuple((pose_at(base, 0.5).position(1) - other.place).tolist()))
    return merged(base, there, 1, 0.5), orange, cyan


def test_a_grafting_node_keeps_a_pair_for_each_clip() -> None:
    part, orange, cyan = graft_of_figure_13()
    assert parameters_at(part, 1) == ((orange, 0.6), (cyan, 0.3))


def test_a_grafting_node_can_be_removed_and_put_back_with_both_motions() -> None:
    """Figure 13: the paper gives up both motions; here the single bone turns by both."""
    part, orange, cyan = graft_of_figure_13()
    single = without_node(part, 1)
    end = single.nodes[-1]
    assert [layer.clip for turn in end.bone.turns for layer in turn.layers] == [orange, cyan]
    for time in TIMES:
        assert apart(part, single, time)[0] < 1e-9
    share = end.bone.turns[0].end
    assert share == pytest.approx(0.5)
    again = with_node(single, end.id, share)
    assert parameters_at(again, single.next_id) == ((orange, 0.6), (cyan, 0.3))
    for time in TIMES:
        first, second = pose_at(part, time), pose_at(again, time)
        assert_allclose(np.abs((first.rotations * second.rotations).sum(axis=1)), 1.0, atol=1e-12)


def random_edit(random: np.random.Generator, part: Part) -> Part:
    bone, time = some_bone(random, part), float(random.uniform(-1.0, 3.0))
    share = float(random.uniform(0.1, 0.9))
    off = branch_of(part, bone, time)
    edits: list[Callable[[], Part]] = [
        lambda: with_node(part, bone, share),
        lambda: without_node(part, bone) if len(part) > 4 else with_tip(part, bone, (0, 0.3, 1)),
        lambda: with_tip(part, bone, (0.4, 0.0, 0.3)),
        lambda: merged(*cut(part, bone, share, time), part.next_id, time),
        lambda: without_branch(part, bone) if len(part) - len(off) > 3 else part,
        lambda: merged(part, off, part.root.id, time) if len(part) < 20 else part,
        lambda: mirrored(part, (0.1, 0.0, 0.0), random.normal(size=3)),
        lambda: scaled(part, share + 0.5, (0.0, 0.0, 0.0)),
        lambda: turned(part, some_quaternion(random), (0.0, 0.0, 0.0)),
        lambda: rerooted(part, bone, time),
        lambda: bent(part, bone, some_quaternion(random), time),
        lambda: delayed(part, share),
    ]
    return edits[int(random.integers(len(edits)))]()


def content(part: Part) -> bytes:
    return pickle.dumps((part.place, part.nodes))


def test_a_thousand_edits_are_undone_to_the_same_bytes() -> None:
    """Undo is the old version, which no edit writes to; on the way every pose is finite."""
    random = np.random.default_rng(18)
    versions = [some_part(random)]
    written = [content(versions[0])]
    for _ in range(1000):
        versions.append(random_edit(random, versions[-1]))
        written.append(content(versions[-1]))
    assert [content(version) for version in versions] == written
    for version in versions[::20]:
        assert np.isfinite(pose_at(version, 0.6).positions).all()
        norms = np.linalg.norm(pose_at(version, 0.6).rotations, axis=1)
        assert_allclose(norms, 1.0, atol=1e-12)


def test_motion_is_copied_to_another_chain_and_taken_off() -> None:
    random = np.random.default_rng(6)
    part = some_part(random, 5, clips=1)
    clip = next(
        layer.clip for node in part.nodes for turn in node.bone.turns for layer in turn.layers
    )
    chain = [node.id for node in part.nodes if parameters_at(part, node.id)]
    whole = [part.node(chain[0]).id, *chain[1:]]
    assert clips_on(part, whole)[0].clip == clip
    line = part_of(np.column_stack([np.arange(4.0), *np.zeros((2, 4))]), np.arange(-1, 3))
    pasted = with_clip(line, range(4), LaidClip(clip, 0.0, 1.0))
    assert clips_on(pasted, range(4)) == (LaidClip(clip, 0.0, 1.0),)
    assert without_clip(pasted, clip) == line
    assert_array_equal(modelled_pose(pasted).positions, pose_at(line, 0.5).positions)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda part: with_node(part, 0, 0.5), "root"),
        (lambda part: with_node(part, 1, 1.0), "between 0 and 1"),
        (lambda part: with_node(part, 77, 0.5), "no node 77"),
        (lambda part: without_node(part, 0), "root"),
        (lambda part: cut(part, 1, 1.0, 0.0), "below 1"),
        (lambda part: cut(part, 0, 0.5, 0.0), "needs a bone"),
        (lambda part: without_branch(part, 0), "root"),
        (lambda part: merged(part, part, 77, 0.0), "no node 77"),
        (lambda part: scaled(part, 0.0, (0, 0, 0)), "positive"),
        (lambda part: mirrored(part, (0, 0, 0), (0, 0, 0)), "normal"),
        (lambda part: clips_on(part, (0,)), "two nodes"),
        (lambda part: clips_on(part, (1, 0)), "no bone leads"),
    ],
)
def test_an_edit_that_cannot_be_is_refused_in_one_line(
    edit: Callable[[Part], object], said: str
) -> None:
    part = some_part(np.random.default_rng(0), 4)
    with pytest.raises(ValueError, match=said) as error:
        edit(part)
    assert "\n" not in str(error.value)
