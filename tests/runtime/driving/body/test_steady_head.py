"""A head that flips for one frame, as a depth camera's does, hardly turns the character's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.runtime.driving.body.test_body_driver import body, driver_of, follow
from tests.runtime.stick_figures import BODY, node, pose


def nodding(*degrees: float) -> list[np.ndarray]:
    """Poses of a performer whose head leans forward by these angles."""
    neck, head = BODY.index("SpineShoulder"), BODY.index("Head")
    poses = []
    for angle in degrees:
        joints = pose()
        lean = Rotation.from_rotvec([np.radians(angle), 0.0, 0.0])
        joints[head] = joints[neck] + lean.apply(joints[head] - joints[neck])
        poses.append(joints)
    return poses


def leans(*degrees: float) -> np.ndarray:
    """How far (T,) [degrees] the character's head leans then."""
    nodes = follow(driver_of(body()), *nodding(*degrees))
    turns = Rotation.from_quat([each.rotations[node("head")] for each in nodes])
    return turns.as_rotvec(degrees=True)[:, 0]


def test_a_head_that_flips_for_one_frame_twitches() -> None:
    angles = leans(0.0, 0.0, 70.0, 0.0, 0.0)
    assert abs(angles[2] - angles[1]) < 30.0


def test_a_head_that_nods_as_fast_as_people_do_nods_at_once() -> None:
    degrees = np.append(np.arange(0.0, 61.0, 15.0), np.arange(45.0, -1.0, -15.0))
    assert leans(*degrees) - leans(0.0) == pytest.approx(degrees, abs=1e-6)
