"""All chains of a body together do what each would do alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.retarget.chain_retargets import ChainRetargets
from solvers.retarget.polyline_motion import ChainMap, map_chain

FRONT = np.eye(3)
SOURCES = [(0, 1, 2, 3), (5, 4), (1, 6, 5)]  # joints may serve more than one chain
REST = np.random.default_rng(3).normal(size=(7, 3))
TARGETS = [np.random.default_rng(count).normal(size=(count, 3)) for count in (6, 2, 4)]
ENDS = [5, 6, 9]  # of each target's bones among all
FULL = np.ones(3)


def maps() -> list[ChainMap]:
    return [
        map_chain(REST[list(source)], target, FRONT, FRONT)
        for source, target in zip(SOURCES, TARGETS, strict=True)
    ]


def poses(count: int) -> np.ndarray:
    """A body that turns from its rest, 40 degrees a frame, and bends a little."""
    away = np.random.default_rng(4).normal(size=REST.shape)
    axis = np.cross(REST[1] - REST[0], [1.0, 0.0, 0.0])  # the first bone comes to lie opposed
    angles = np.radians(40.0) * np.arange(count)[:, None]
    turns = Rotation.from_rotvec(angles * axis / np.linalg.norm(axis))
    return np.array([turn.apply(REST + 0.02 * k * away) for k, turn in enumerate(turns)])


def alone(positions: np.ndarray) -> np.ndarray:
    """(T, 9, 4) what each chain does that knows of no other."""
    retargets = [
        ChainRetargets([chain], [source]) for chain, source in zip(maps(), SOURCES, strict=True)
    ]
    return np.array(
        [np.concatenate([one.rotations(pose, FULL[:1]) for one in retargets]) for pose in positions]
    )


def test_each_chain_does_what_it_would_do_alone_frame_after_frame() -> None:
    moving, together = poses(6), ChainRetargets(maps(), SOURCES)
    for pose, expected in zip(moving, alone(moving), strict=True):
        np.testing.assert_allclose(together.rotations(pose, FULL), expected, atol=1e-14)
    fresh = alone(moving[-1:])[0]
    assert np.abs(fresh - expected).max() > 0.1, "what came before makes a difference"
    together.reset()
    np.testing.assert_allclose(together.rotations(moving[-1], FULL), fresh, atol=1e-14)


def test_a_gain_makes_the_turns_of_its_own_chain_smaller() -> None:
    pose = poses(2)[1]
    full = np.split(ChainRetargets(maps(), SOURCES).rotations(pose, FULL), ENDS[:2])
    held = np.split(
        ChainRetargets(maps(), SOURCES).rotations(pose, np.array([1.0, 0.25, 1.0])), ENDS[:2]
    )
    for chain in (0, 2):
        np.testing.assert_array_equal(held[chain], full[chain])
    vectors = [Rotation.from_quat(turns[1]).as_rotvec() for turns in (full, held)]
    assert np.linalg.norm(vectors[0]) > 0.1
    np.testing.assert_allclose(vectors[1], 0.25 * vectors[0], atol=1e-12)


def test_going_on_from_a_snapshot_gives_the_same_bytes() -> None:
    moving, retargets = poses(8), ChainRetargets(maps(), SOURCES)
    for pose in moving[:4]:
        retargets.rotations(pose, FULL)
    state = retargets.snapshot()
    expected = [retargets.rotations(pose, FULL).tobytes() for pose in moving[4:]]
    other = ChainRetargets(maps(), SOURCES)
    for restored in (retargets, other, other):
        restored.restore(state)
        assert [restored.rotations(pose, FULL).tobytes() for pose in moving[4:]] == expected
    with pytest.raises(ValueError, match="expected a state of 0 bones, got 6"):
        ChainRetargets((), ()).restore(state)


def test_a_body_may_have_no_chains() -> None:
    assert ChainRetargets((), ()).rotations(REST, np.ones(0)).shape == (0, 4)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="expected 4 joints, got 3"):
        ChainRetargets(maps(), [(0, 1, 2), *SOURCES[1:]])
    retargets = ChainRetargets(maps(), SOURCES)
    with pytest.raises(ValueError, match=r"expected at least 7 joints .*got \(6, 3\)"):
        retargets.rotations(REST[:6], FULL)
    with pytest.raises(ValueError, match=r"expected gains of shape \(3,\), got \(2,\)"):
        retargets.rotations(REST, FULL[:2])
