"""Recordings as BVH: exact where the source has bones, nearest where it has only joints."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.builtin.gestures import RATE
from devices.builtin.motions import motion_clip
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.bvh.export import BvhSummary, write_bvh_recording
from replay.bvh.reader import read_bvh
from replay.bvh.writer import UNITS
from replay.even_times import even_times
from replay.recording import Recording
from replay.rigid_bones import fit_rigid_bones

Array = NDArray[np.float64]


def recording(
    skeleton: Skeleton,
    positions: Array,
    rotations: Array | None = None,
    times: Array | None = None,
) -> Recording:
    frames = len(positions)
    seen = np.isfinite(positions).all(axis=2)
    return Recording(
        skeleton=skeleton,
        times=np.arange(frames) / RATE if times is None else times,
        positions=positions,
        rotations=rotations,
        confidence=seen.astype(np.float64),
        performers=np.zeros(frames, np.int64),
        arrivals=np.full(frames, np.nan),
    )


def written(made_of: Recording, **options: object) -> tuple[str, BvhSummary]:
    file = io.StringIO()
    made = write_bvh_recording(file, made_of, **options)
    return file.getvalue(), made


def understood(text: str) -> tuple[dict[str, Array], float]:
    """Each joint's places (T, 3) in the file's unit, by a reader that shares nothing with ours.

    Written from the format's description: words, a stack of matrices, SciPy's Euler angles.
    """
    head, body = text.split("MOTION")
    frames, step = re.search(r"Frames: (\d+)\nFrame Time: ([\d.]+)\n", body).groups()
    rows = np.array([line.split() for line in body.splitlines()[3:]], np.float64)
    assert len(rows) == int(frames)
    places: dict[str, Array] = {}
    stack: list[tuple[str, Array, Rotation]] = []
    words, column, name = iter(head.split()), 0, ""
    offset = np.zeros(3)
    for word in words:
        if word in ("ROOT", "JOINT"):
            name = next(words)
        elif word == "End":
            name = f"{stack[-1][0]}_end"
            assert [next(words) for _ in range(3)] == ["Site", "{", "OFFSET"]
            offset = np.array([float(next(words)) for _ in range(3)])
            places[name] = stack[-1][1] + stack[-1][2].apply(offset)
            assert next(words) == "}"
        elif word == "OFFSET":
            offset = np.array([float(next(words)) for _ in range(3)])
        elif word == "CHANNELS":
            kinds = [next(words) for _ in range(int(next(words)))]
            values = rows[:, column : column + len(kinds)]
            column += len(kinds)
            local = np.tile(offset, (len(rows), 1))
            if kinds[0].endswith("position"):
                assert kinds[:3] == ["Xposition", "Yposition", "Zposition"]
                local, kinds, values = values[:, :3], kinds[3:], values[:, 3:]
            order = "".join(kind[0] for kind in kinds)
            turn = Rotation.from_euler(order, values, degrees=True)  # capitals: about turned axes
            if stack:
                local = stack[-1][1] + stack[-1][2].apply(local)
                turn = stack[-1][2] * turn
            places[name] = local
            stack.append((name, local, turn))
        elif word == "}":
            stack.pop()
    assert column == rows.shape[1]
    assert not stack
    return places, float(step)


def assert_places(text: str, of: Recording, unit: str = "cm", atol: float = 1e-6) -> None:
    places, step = understood(text)
    assert step == pytest.approx(1 / RATE, abs=1e-8)
    for joint, name in enumerate(of.skeleton.names):
        found = places[name] / UNITS[unit]
        np.testing.assert_allclose(found, of.positions[:, joint], atol=atol, err_msg=name)


@pytest.mark.parametrize("unit", UNITS)
def test_bones_that_keep_their_length_come_back_exactly_in_every_unit(unit: str) -> None:
    act = motion_clip("show")
    played = recording(act.skeleton, act.positions[:90], act.rotations[:90])
    text, made = written(played, unit=unit)
    assert_places(text, played, unit, atol=2e-6)
    assert made.frames == 90
    assert made.filled == 0.0
    assert max(made.strays) < 1e-9


def test_without_rotations_every_joint_is_still_where_it_was() -> None:
    act = motion_clip("show")
    played = recording(act.skeleton, act.positions[:90])
    text, _ = written(played)
    assert_places(text, played, atol=1e-4)


def test_rotations_of_the_source_decide_the_twist() -> None:
    arm = Skeleton(("shoulder", "elbow", "hand"), np.array([-1, 0, 1]), np.eye(3).cumsum(axis=0))
    turns = Rotation.from_euler("x", np.linspace(0, 2, 20)[:, None])
    bone = arm.rest_positions[1] - arm.rest_positions[0]
    about_the_bone = Rotation.from_rotvec(np.linspace(0, 1, 20)[:, None] * bone)
    shoulder, elbow = turns * about_the_bone, turns * about_the_bone
    upper = shoulder.apply(bone)
    lower = elbow.apply(arm.rest_positions[2] - arm.rest_positions[1])
    positions = np.stack([np.zeros((20, 3)), upper, upper + lower], axis=1)
    quaternions = np.stack([turn.as_quat() for turn in (shoulder, elbow, elbow)], axis=1)
    # Each joint's own frame may lie in it as it likes.
    own = Rotation.random(3, rng=np.random.default_rng(4))
    skewed = (Rotation.from_quat(quaternions.reshape(-1, 4)) * own[np.tile(range(3), 20)]).as_quat()
    for given_turns in (quaternions, skewed.reshape(20, 3, 4)):
        motion = fit_rigid_bones(arm, positions, given_turns)
        np.testing.assert_allclose(motion.positions(), positions, atol=1e-9)
        for joint, known in enumerate((shoulder, elbow)):
            found = Rotation.from_matrix(motion.rotations[:, joint])
            strays = found * found[0].inv() * (known * known[0].inv()).inv()
            assert strays.magnitude().max() < 1e-6


def test_rotations_that_carry_no_bone_are_left_aside() -> None:
    act = motion_clip("show")
    random = Rotation.random(60 * len(act.skeleton.names), rng=np.random.default_rng(0)).as_quat()
    nonsense = random.reshape(60, -1, 4)
    with_them = fit_rigid_bones(act.skeleton, act.positions[:60], nonsense)
    without = fit_rigid_bones(act.skeleton, act.positions[:60])
    np.testing.assert_allclose(with_them.rotations, without.rotations, atol=1e-9)


def test_unknown_rotations_and_joints_leave_no_hole() -> None:
    act = motion_clip("show")
    positions, rotations = act.positions[:120].copy(), act.rotations[:120].copy()
    positions[30:60, 5] = np.nan
    rotations[20:50] = np.nan
    text, made = written(recording(act.skeleton, positions, rotations))
    places, _ = understood(text)
    assert all(np.isfinite(way).all() for way in places.values())
    assert made.filled == pytest.approx(30 / (120 * len(act.skeleton.names)))
    hidden = places[act.skeleton.names[5]][30:60] / 100
    assert np.abs(hidden - act.positions[30:60, 5]).max() < 0.5


def test_wavering_bones_get_their_median_length() -> None:
    act = motion_clip("show")
    noise = np.random.default_rng(1).normal(scale=0.005, size=act.positions[:200].shape)
    played = recording(act.skeleton, act.positions[:200] + noise)
    text, made = written(played)
    places, _ = understood(text)
    upper, lower = (act.skeleton.index(name) for name in ("HipLeft", "KneeLeft"))
    bone = np.linalg.norm(act.skeleton.rest_positions[lower] - act.skeleton.rest_positions[upper])
    lengths = np.linalg.norm(places["KneeLeft"] - places["HipLeft"], axis=1) / 100
    assert np.ptp(lengths) < 1e-6
    assert lengths[0] == pytest.approx(bone, rel=0.01)
    assert made.strays[0] < 0.02


def test_hips_that_walk_away_from_a_root_that_stays_are_followed() -> None:
    skeleton = Skeleton(
        ("ground", "hips", "chest"),
        np.array([-1, 0, 1]),
        np.array([[0.0, 0, 0], [0, 1, 0], [0, 1.5, 0]]),
    )
    positions = np.tile(skeleton.rest_positions, (100, 1, 1))
    positions[:, 1:, 2] += np.linspace(0, 5, 100)[:, None]
    played = recording(skeleton, positions)
    text, made = written(played)
    assert "JOINT hips\n\t{\n\t\tOFFSET" in text
    assert_places(text, played)
    assert max(made.strays) < 1e-9


def test_jitter_and_gaps_become_even_times_that_keep_the_timing() -> None:
    random = np.random.default_rng(3)
    times = np.arange(200) / 50 + random.uniform(0, 0.01, 200)
    times[100:] += 1.0
    times -= times[0]
    skeleton = Skeleton(("a", "b"), np.array([-1, 0]), np.array([[0.0, 0, 0], [0, 1, 0]]))
    positions = np.tile(skeleton.rest_positions, (200, 1, 1))
    positions[:, :, 0] = 0.5 * times[:, None]  # at an even speed
    text, made = written(recording(skeleton, positions, times=times))
    places, step = understood(text)
    assert 40 < 1 / step < 60
    assert step * (made.frames - 1) == pytest.approx(times[-1], abs=1e-6)
    expected = 50 * step * np.arange(made.frames)
    np.testing.assert_allclose(places["a"][:, 0], expected, atol=1e-4)


@pytest.mark.parametrize(("rate", "frames"), [(30.0, 46), (120.0, 181), (7.0, 11)])
def test_a_rate_that_is_asked_for_is_the_files(rate: float, frames: int) -> None:
    act = motion_clip("show")
    text, made = written(recording(act.skeleton, act.positions[:91]), rate=rate)
    assert (made.frames, made.step) == (frames, 1 / rate)
    places, step = understood(text)
    assert step == pytest.approx(1 / rate, abs=1e-8)
    if rate == 30.0:
        assert np.abs(places["Head"] / 100 - act.positions[:91:2, 4]).max() < 1e-4


@settings(deadline=None)
@given(st.lists(st.floats(1e-4, 5.0), min_size=1, max_size=40), st.floats(0.5, 500.0))
def test_even_times_lie_within_and_never_grow_beyond_all_bounds(
    steps: list[float], rate: float
) -> None:
    times = np.cumsum([0.0, *steps])
    for wanted in (None, rate):
        even = even_times(times, wanted)
        assert even is not None
        at = even.vectors(times)
        assert wanted is not None or len(at) <= 16 * len(times) + 2
        assert at[0] == 0.0
        assert at[-1] <= times[-1] + 1e-9
        np.testing.assert_allclose(np.diff(at), even.step, rtol=1e-6, atol=1e-9)


def test_more_frames_than_a_file_can_hold_are_refused() -> None:
    act = motion_clip("show")
    with pytest.raises(InputError, match="too many; give a lower rate"):
        written(recording(act.skeleton, act.positions[:91]), rate=1e6)
    with pytest.raises(InputError, match="too many; give a lower rate"):
        even_times(np.array([0.0, 1e9]), 1000.0)


def test_one_frame_is_a_file_of_one_frame() -> None:
    act = motion_clip("show")
    text, made = written(recording(act.skeleton, act.positions[:1]))
    assert made.frames == 1
    assert "Frames: 1\n" in text
    lone = Skeleton(("only",), np.array([-1]), np.zeros((1, 3)))
    places, _ = understood(written(recording(lone, np.ones((1, 1, 3))))[0])
    np.testing.assert_allclose(places["only"], [[100.0, 100.0, 100.0]])


@pytest.mark.parametrize(
    "name",
    [
        "bandai1_dash_happy_001.bvh",  # hips that leave a standing root
        "truebones_elephant_idle1.bvh",  # joints that slide
        "cmu_daz_salsa_10.bvh",
        "xia_neutral_01_000.bvh",
        "makehuman_tpose_1frame.bvh",
    ],
)
def test_real_files_come_back_joint_for_joint(name: str, shared: Path, tmp_path: Path) -> None:
    first = read_bvh(shared / "bvh" / name)
    with (tmp_path / "a.bvh").open("w") as file:
        made = write_bvh_recording(file, first)
    again = read_bvh(tmp_path / "a.bvh")
    assert again.skeleton.names == first.skeleton.names
    assert made.frames == len(first) == len(again)
    assert np.abs(again.positions - first.positions).max() < 1e-5  # [m]
    with (tmp_path / "b.bvh").open("w") as file:
        write_bvh_recording(file, again)
    assert len((tmp_path / "b.bvh").read_text().split()) == len(
        (tmp_path / "a.bvh").read_text().split()
    )
