"""Whatever `bunraku convert` writes, it reads back as the same motion."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton, SkeletonFrame
from replay.formats import read_recording
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from replay.stated import Stated
from runtime.cli.conversion import Conversion, convert
from tests.thorough import examples

NAMES = st.lists(
    st.text(st.characters(codec="utf-8"), min_size=1, max_size=12), min_size=1, unique=True
)
PLACES = st.floats(-1e5, 1e5, width=64)


@st.composite
def skeletons(draw: st.DrawFn) -> Skeleton:
    """A tree of one to six joints in any order, with any names."""
    names = draw(NAMES.filter(lambda names: len(names) <= 6))
    order = draw(st.permutations(range(len(names))))
    parents = np.full(len(names), -1)
    for place, joint in enumerate(order[1:], 1):
        parents[joint] = order[draw(st.integers(0, place - 1))]
    rest = draw(
        st.lists(st.floats(-500.0, 500.0), min_size=3 * len(names), max_size=3 * len(names))
    )
    return Skeleton(tuple(names), parents, np.reshape(rest, (-1, 3)))


@st.composite
def frames(draw: st.DrawFn, joints: int) -> list[SkeletonFrame]:
    """Frames of some performers with gaps, from time 0."""
    times = [0.0, *sorted(draw(st.lists(st.floats(0.0, 1e6), max_size=5)))]
    turned = draw(st.booleans())
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    made = []
    for time in times:
        places = np.reshape(
            draw(st.lists(PLACES, min_size=3 * joints, max_size=3 * joints)), (-1, 3)
        )
        seen = chance.random(joints) < 0.8
        turns = Rotation.random(joints, random_state=chance).as_quat()
        made.append(
            SkeletonFrame(
                time,
                np.where(seen[:, None], places, np.nan),
                np.where(seen[:, None], turns, np.nan) if turned else None,
                np.where(seen, np.maximum(chance.random(joints), 0.01), 0.0),
                int(chance.integers(3)),
                draw(st.one_of(st.just(float("nan")), st.floats(0.0, 1e6))),
            )
        )
    return made


def recorded(folder: Path, skeleton: Skeleton, given_frames: list[SkeletonFrame]) -> Path:
    path = folder / "a.mcap"
    with McapWriter(path, skeleton) as writer:
        for frame in given_frames:
            writer.write(frame)
    return path


def converted(path: Path, name: str, **more: str) -> Path:
    out = path.parent / name
    for _ in convert(Conversion(path, out, **more)):
        pass
    return out


def assert_same(one: Recording, other: Recording) -> None:
    assert one.skeleton.names == other.skeleton.names
    np.testing.assert_array_equal(one.skeleton.parents, other.skeleton.parents)
    np.testing.assert_array_equal(one.skeleton.rest_positions, other.skeleton.rest_positions)
    assert (one.rotations is None) == (other.rotations is None)
    for field in ("times", "positions", "rotations", "confidence", "performers", "arrivals"):
        if getattr(one, field) is not None:
            np.testing.assert_array_equal(getattr(one, field), getattr(other, field), field)


@given(st.data())
@settings(max_examples=examples(200), deadline=None)
def test_tables_and_mcap_give_back_every_bit(data: st.DataObject) -> None:
    skeleton = data.draw(skeletons())
    with tempfile.TemporaryDirectory() as folder:
        path = recorded(Path(folder), skeleton, data.draw(frames(len(skeleton.names))))
        first = read_recording(path)
        assert first.skeleton.names == skeleton.names
        table = converted(path, "b.csv")
        assert_same(first, read_recording(table))
        assert_same(first, read_recording(converted(table, "c.mcap")))


@given(st.integers(0, 2**32), st.sampled_from(["cm", "m", "mm", "in"]))
@settings(max_examples=examples(100), deadline=None)
def test_bvh_gives_back_rigid_motion(seed: int, unit: str) -> None:
    """But for the place on the floor and the heading, which a reader of BVH puts to the front."""
    chance = np.random.default_rng(seed)
    joints, count = int(chance.integers(2, 8)), int(chance.integers(2, 6))
    parents = np.array([-1, *(int(chance.integers(joint)) for joint in range(1, joints))])
    offsets = chance.normal(size=(joints, 3))
    offsets *= chance.uniform(0.05, 1.0, joints)[:, None] / np.linalg.norm(offsets, axis=1)[:, None]
    turns = Rotation.random(count * joints, random_state=chance).as_matrix()
    turns = turns.reshape(count, joints, 3, 3)
    rest, places = np.zeros((joints, 3)), np.zeros((count, joints, 3))
    places[:, 0] = chance.normal(size=(count, 3))
    for joint in range(1, joints):
        above = parents[joint]
        rest[joint] = rest[above] + offsets[joint]
        places[:, joint] = places[:, above] + turns[:, above] @ offsets[joint]
    quaternions = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(count, joints, 4)
    skeleton = Skeleton(tuple(f"j{joint}" for joint in range(joints)), parents, rest)
    with tempfile.TemporaryDirectory() as folder:
        path = recorded(
            Path(folder),
            skeleton,
            [
                SkeletonFrame(frame / 30, places[frame], quaternions[frame], np.ones(joints))
                for frame in range(count)
            ],
        )
        out = converted(path, "b.bvh", unit=unit)
        again = read_recording(out, Stated(unit=unit, up="y"))
    own = [again.skeleton.index(name) for name in skeleton.names]
    got = again.positions[:, own]
    np.testing.assert_allclose(again.times, np.arange(count) / 30, atol=1e-5)
    lift = got[0, 0, 1] - places[0, 0, 1]
    np.testing.assert_allclose(got[..., 1], places[..., 1] + lift, atol=2e-4)
    np.testing.assert_allclose(
        np.linalg.norm(got[:, :, None] - got[:1, :1, None], axis=-1),
        np.linalg.norm(places[:, :, None] - places[:1, :1, None], axis=-1),
        atol=2e-4,
    )
    assert again.rotations is not None
    turned = Rotation.from_quat(again.rotations[:, own].reshape(-1, 4))
    wanted = Rotation.from_quat(quaternions.reshape(-1, 4))
    about = turned * wanted.inv()  # the heading, the same for all
    off = (about[0].inv() * about).magnitude().reshape(count, joints)
    inner = np.isin(np.arange(joints), parents)
    np.testing.assert_allclose(off[:, inner], off[0, 0], atol=2e-3)
