"""Motion from one polyline to another: bases, samples, rotations and continuity."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.retarget.chain_retargets import ChainRetargets
from solvers.retarget.polyline_motion import basis_change, map_chain, mean_direction, view_basis
from tests.thorough import examples

FRONT = np.eye(3)


class Retarget:
    """Carries the motion of one polyline over to another, frame by frame."""

    def __init__(self, source, target, source_view=FRONT, target_view=FRONT, flip=False):
        chain = map_chain(source, target, source_view, target_view, flip)
        self._chains = ChainRetargets([chain], [range(len(source))])
        self.reset = self._chains.reset

    def rotations(self, pose):
        return self._chains.rotations(pose, np.ones(1))


def cumulative_rotations(source, pose):
    """World rotations of a polyline's bones from rest, without any history."""
    return Retarget(source, source).rotations(pose)


def polyline(lengths, angles):
    """Points of a polyline in the screen plane; each bone has its angle to +x."""
    bones = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return np.concatenate([[[0.0, 0, 0]], np.cumsum(np.asarray(lengths)[:, None] * bones, axis=0)])


def straight(count, direction=(1.0, 0.0, 0.0)):
    return np.outer(np.linspace(0.0, 1.0, count + 1), direction)


def turns(quaternions):
    """Turning angles about the viewing direction."""
    return 2.0 * np.arctan2(quaternions[:, 2], quaternions[:, 3])


def apply(rest, quaternions):
    """The polyline after its bones have turned."""
    bones = Rotation.from_quat(quaternions).apply(np.diff(rest, axis=0))
    return np.concatenate([rest[:1], rest[0] + np.cumsum(bones, axis=0)])


def random_polyline(rng, count):
    return np.cumsum(rng.normal(size=(count + 1, 3)), axis=0)


def angle_between(a, b):
    return (Rotation.from_quat(a).inv() * Rotation.from_quat(b)).magnitude()


def test_figure_4_turning_angles_spread_linearly_along_the_bones():
    rest, lengths = [0.0, 0.0, 0.0], [1.0, 2.0, 1.0]
    source = polyline(lengths, rest)
    pose = polyline(lengths, [0.2, 0.9, -0.4])
    target = straight(16)
    sampled = turns(Retarget(source, target, FRONT, FRONT).rotations(pose))
    middles = (np.arange(16) + 0.5) / 16
    expected = np.interp(middles, [0.125, 0.5, 0.875], [0.2, 0.9, -0.4])
    expected[-1] = -0.4
    np.testing.assert_allclose(sampled, expected, atol=1e-12)


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 100_000), st.integers(1, 6), st.integers(1, 40))
def test_the_total_turning_survives_any_resampling(seed, bones, samples):
    rng = np.random.default_rng(seed)
    source = random_polyline(rng, bones)
    pose = random_polyline(rng, bones)
    target = np.sort(rng.uniform(size=samples + 1))[:, None] * mean_direction(source)
    target[-1] += 1e-3 * mean_direction(source)
    sampled = Retarget(source, target, FRONT, FRONT).rotations(pose)
    total = cumulative_rotations(source, pose)[-1]
    assert angle_between(sampled[-1], total) < 1e-7
    np.testing.assert_allclose(np.linalg.norm(sampled, axis=1), 1.0, atol=1e-12)


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 100_000), st.integers(1, 8))
def test_the_same_sampling_takes_over_the_pose(seed, bones):
    rng = np.random.default_rng(seed)
    source = random_polyline(rng, bones)
    lengths = np.linalg.norm(np.diff(source, axis=0), axis=1)
    directions = rng.normal(size=(bones, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    pose = np.concatenate(
        [source[:1], source[0] + np.cumsum(lengths[:, None] * directions, axis=0)]
    )
    retarget = Retarget(source, source, FRONT, FRONT)
    np.testing.assert_allclose(apply(source, retarget.rotations(pose)), pose, atol=1e-7)


@given(st.integers(0, 100_000), st.integers(1, 6), st.integers(1, 20))
@settings(max_examples=examples(40), deadline=None)
def test_rest_gives_rest(seed, bones, samples):
    rng = np.random.default_rng(seed)
    source, target = random_polyline(rng, bones), random_polyline(rng, samples)
    view = Rotation.random(random_state=seed).as_matrix()
    sampled = Retarget(source, target, FRONT, view).rotations(source)
    np.testing.assert_allclose(np.abs(sampled[:, 3]), 1.0, atol=1e-12)


def test_an_arm_raised_at_the_shoulder_raises_a_straight_tentacle_straight():
    source = polyline([0.3, 0.3, 0.2], [0.0, 0.0, 0.0])
    raised = polyline([0.3, 0.3, 0.2], [np.pi / 2] * 3)
    tentacle = straight(12, (2.0, 0.0, 0.0))
    moved = apply(tentacle, Retarget(source, tentacle, FRONT, FRONT).rotations(raised))
    np.testing.assert_allclose(moved, straight(12, (0.0, 2.0, 0.0)), atol=1e-12)


def test_a_bent_elbow_spreads_evenly_and_keeps_the_sampled_curve_near_the_arm():
    source = polyline([1.0, 1.0], [0.0, 0.0])
    bent = polyline([1.0, 1.0], [0.0, np.pi / 2])
    for count in (12, 48):
        tentacle = straight(count, (2.0, 0.0, 0.0))
        sampled = turns(Retarget(source, tentacle, FRONT, FRONT).rotations(bent))
        steps = np.diff(sampled)
        assert (steps > -1e-12).all()
        assert steps.max() <= np.pi / count + 1e-12  # no kink
        np.testing.assert_allclose(sampled + sampled[::-1], np.pi / 2, atol=1e-12)
    tip = apply(tentacle, Retarget(source, tentacle, FRONT, FRONT).rotations(bent))[-1]
    np.testing.assert_allclose(tip, [0.5 + 2 / np.pi] * 2 + [0.0], atol=1e-3)  # an arc's chord


def test_up_stays_up_on_a_limb_that_points_the_other_way():
    source = straight(2)
    raised = straight(2, (0.0, 1.0, 0.0))
    target = straight(5, (-1.0, -0.4, 0.0))
    tip = apply(target, Retarget(source, target, FRONT, FRONT).rotations(raised))[-1]
    np.testing.assert_allclose(tip, [-0.4, 1.0, 0.0], atol=1e-12)  # up, on its own side
    flipped = Retarget(source, target, FRONT, FRONT, flip=True).rotations(raised)
    np.testing.assert_allclose(apply(target, flipped)[-1], [0.4, -1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("lean", [-0.1, -1e-9, 0.0, 1e-9, 0.1])
@pytest.mark.parametrize("other", [-0.12, 0.0, 0.12])
def test_hanging_limbs_swing_the_same_way_whichever_way_they_lean(lean, other):
    source, target = straight(2, (lean, -1.0, 0.0)), straight(7, (other, -1.0, 0.0))
    kick = source @ Rotation.from_euler("z", 0.8).as_matrix().T
    sampled = Retarget(source, target, FRONT, FRONT).rotations(kick)
    np.testing.assert_allclose(turns(sampled), 0.8, atol=1e-9)


def test_a_kick_towards_the_viewer_stays_one_though_the_first_bone_crosses_the_hips():
    leg = np.array([(0.0, 0, 0), (0.1, 0, 0), (0.1, -0.4, 0), (0.1, -0.8, 0)])
    kick = np.array([(0.0, 0, 0), (0.1, 0, 0), (0.1, 0.0, 0.4), (0.1, 0.0, 0.8)])
    target = straight(12, (0.05, -1.0, 0.0))
    tip = apply(target, Retarget(leg, target, FRONT, FRONT).rotations(kick))[-1]
    assert tip[2] > 0.7
    assert abs(tip[0]) < 0.3 * tip[2]


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 100_000), st.floats(-3.1, 3.1))
def test_turning_both_about_the_view_axis_turns_the_result(seed, angle):
    rng = np.random.default_rng(seed)
    source = random_polyline(rng, 3)
    target = straight(9, mean_direction(source))
    pose = random_polyline(rng, 3)
    spin = Rotation.from_euler("z", angle)
    still = Retarget(source, target, FRONT, FRONT).rotations(pose)
    both = Retarget(spin.apply(source), spin.apply(target), FRONT, FRONT)
    expected = spin * Rotation.from_quat(still) * spin.inv()
    found = Rotation.from_quat(both.rotations(spin.apply(pose)))
    assert (expected.inv() * found).magnitude().max() < 1e-6


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(0, 100_000))
def test_what_the_camera_sees_decides_not_where_it_stands(seed):
    rng = np.random.default_rng(seed)
    source, target, pose = (random_polyline(rng, n) for n in (3, 6, 3))
    orbit = Rotation.random(random_state=seed)
    still = Retarget(source, target, FRONT, FRONT).rotations(pose)
    moved = Retarget(source, orbit.apply(target), FRONT, orbit.inv().as_matrix())
    found = Rotation.from_quat(moved.rotations(pose))
    assert (orbit * Rotation.from_quat(still) * orbit.inv() * found.inv()).magnitude().max() < 1e-6


def test_bases_are_right_handed_and_their_y_axes_point_up():
    rng = np.random.default_rng(1)
    for _ in range(50):
        view = Rotation.random(rng=rng).as_matrix()
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        basis = view_basis(direction, view)
        np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-12)
        assert np.linalg.det(basis) == pytest.approx(1.0)
        np.testing.assert_allclose(basis[:, 2], direction, atol=1e-12)
        assert basis[:, 1] @ view[1] >= 0.0
        if np.linalg.norm(np.cross(view[2], direction)) > 0.1:
            assert abs(basis[:, 1] @ view[2]) < 1e-12
    towards = view_basis(np.array([0.0, 0.0, 1.0]), FRONT)
    np.testing.assert_allclose(towards, np.eye(3), atol=1e-12)


def test_equal_directions_and_views_change_nothing():
    direction = np.array([0.6, 0.8, 0.0])
    np.testing.assert_allclose(
        basis_change(direction, direction, FRONT, FRONT), np.eye(3), atol=1e-12
    )


def swing(angle, off=0.0):
    """An upper arm that hangs at rest, raised sideways past its head, `off` out of the plane."""
    d = np.array([np.sin(angle) * np.cos(off), -np.cos(angle), np.sin(angle) * np.sin(off) + off])
    return d / np.linalg.norm(d)


@pytest.mark.parametrize("off", [0.0, 1e-9, 1e-3, -0.02])
def test_an_arm_swung_past_the_opposite_of_its_rest_does_not_whip_round(off):
    rest = np.array([(0.0, 0, 0), (0.2, 0, 0), (0.2, -0.3, 0), (0.2, -0.6, 0)])
    retarget = Retarget(rest, straight(12, (1.0, -1.0, 0.0)), FRONT, FRONT)
    last = None
    for angle in np.radians(np.arange(0.0, 240.0, 1.0)):
        d = swing(angle, off)
        pose = np.array(
            [(0.0, 0, 0), (0.2, 0, 0), *(np.array([0.2, 0, 0]) + np.outer([0.3, 0.6], d))]
        )
        sampled = retarget.rotations(pose)
        if last is not None:
            assert np.degrees(angle_between(last, sampled).max()) < 4.0
        last = sampled


def test_history_leaves_no_twist_behind():
    rng = np.random.default_rng(2)
    rest = straight(3)
    retarget = Retarget(rest, rest, FRONT, FRONT)
    for _ in range(300):
        retarget.rotations(random_polyline(rng, 3))
    pose = polyline([1.0, 1.0, 1.0], [0.3, 0.9, 1.4])
    np.testing.assert_allclose(
        angle_between(retarget.rotations(pose), cumulative_rotations(rest, pose)), 0.0, atol=1e-7
    )


def test_turns_along_the_chain_add_up_past_a_full_circle():
    source = straight(12)
    coiled = polyline(np.ones(12), np.radians(40.0) * np.arange(1, 13))
    sampled = Retarget(source, straight(48), FRONT, FRONT).rotations(coiled)
    total = np.unwrap(turns(sampled), period=4 * np.pi)
    assert np.degrees(total[-1] - total[0]) == pytest.approx(440.0)
    assert (np.diff(total) > -1e-9).all()


def test_reset_forgets_the_last_frame():
    rest = np.array([(0.0, 0, 0), (1.0, 0, 0), (2.0, 0, 0)])
    retarget = Retarget(rest, straight(8), FRONT, FRONT)
    pose = polyline([1.0, 1.0], [0.0, np.radians(200.0)])
    retarget.rotations(polyline([1.0, 1.0], [0.0, np.radians(170.0)]))
    turned_on = retarget.rotations(pose)  # the long way
    expected = np.interp((np.arange(8) + 0.5) / 8, [0.25, 0.75], [0.0, np.radians(200.0)])
    bones = np.column_stack([np.cos(expected), np.sin(expected), np.zeros(8)]) / 8
    np.testing.assert_allclose(np.diff(apply(straight(8), turned_on), axis=0), bones, atol=1e-9)
    retarget.reset()
    fresh = retarget.rotations(pose)
    assert angle_between(turned_on, fresh).max() > 0.5
    np.testing.assert_array_equal(fresh, Retarget(rest, straight(8), FRONT, FRONT).rotations(pose))


def test_bones_without_length_never_give_nan():
    rest = np.array([(0.0, 0, 0), (0.0, 0, 0), (1.0, 0, 0), (1.0, 0, 0)])
    pose = np.array([(0.0, 0, 0), (0.0, 0, 0), (0.0, 1.0, 0), (0.0, 1.0, 0)])
    point = Retarget(rest, np.zeros((4, 3)), FRONT, FRONT).rotations(pose)
    np.testing.assert_allclose(np.linalg.norm(point, axis=1), 1.0, atol=1e-12)
    for target in (straight(4), rest):
        sampled = Retarget(rest, target, FRONT, FRONT).rotations(pose)
        np.testing.assert_allclose(turns(sampled), np.pi / 2, atol=1e-12)
    still = Retarget(np.zeros((3, 3)), rest, FRONT, FRONT).rotations(pose[1:])
    np.testing.assert_array_equal(still, [[0, 0, 0, 1]] * 3)


@pytest.mark.parametrize(
    ("source", "target", "view", "message"),
    [
        (np.zeros((1, 3)), np.zeros((2, 3)), FRONT, "source_rest"),
        (np.zeros((2, 3)), np.zeros((2, 2)), FRONT, "target_rest"),
        (np.zeros((2, 3)), np.zeros((2, 3)), np.eye(4), "target_view"),
    ],
)
def test_wrong_shapes_are_refused(source, target, view, message):
    with pytest.raises(ValueError, match=message):
        Retarget(source, target, FRONT, view)
