"""A puppet of few bricks and a performer to drive it: what the tests of the running show use."""

from __future__ import annotations

from collections.abc import Mapping as Turns
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from devices.builtin.body import builtin_skeleton
from devices.skeleton import Skeleton, SkeletonFrame
from replay.recording import Recording
from runtime.characters.character import Character, Material, Surface
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, Rest, rest_state
from runtime.driving.polyline_driver import PolylineDriver
from runtime.puppet.puppet import Motion, Puppet
from solvers.retarget.heading import turned

BODY = builtin_skeleton()
HIPS = BODY.index("SpineBase")
BRICK = 0.08  # [m]
FRONT_VIEW = np.eye(3)

NODES = {
    "pelvis": ("", (0.0, 0.88, 0.0)),
    "chest": ("pelvis", (0.0, 1.2, 0.0)),
    "head": ("chest", (0.0, 1.56, 0.0)),
    "shoulder.L": ("chest", (0.2, 1.2, 0.0)),
    "elbow.L": ("shoulder.L", (0.52, 1.2, 0.0)),
    "wrist.L": ("elbow.L", (0.86, 1.2, 0.0)),
    "shoulder.R": ("chest", (-0.2, 1.2, 0.0)),
    "elbow.R": ("shoulder.R", (-0.52, 1.2, 0.0)),
    "wrist.R": ("elbow.R", (-0.86, 1.2, 0.0)),
    "hip.L": ("pelvis", (0.16, 0.72, 0.0)),
    "knee.L": ("hip.L", (0.16, 0.4, 0.0)),
    "ankle.L": ("knee.L", (0.16, 0.04, 0.0)),
    "hip.R": ("pelvis", (-0.16, 0.72, 0.0)),
    "knee.R": ("hip.R", (-0.16, 0.4, 0.0)),
    "ankle.R": ("knee.R", (-0.16, 0.04, 0.0)),
}
# Least and greatest corner of each block [m].
BLOCKS = (
    ((-0.24, 0.72, -0.16), (0.24, 1.28, 0.16)),  # trunk
    ((-0.16, 1.28, -0.16), (0.16, 1.6, 0.16)),  # head
    ((-0.88, 1.12, -0.08), (0.88, 1.28, 0.08)),  # arms
    ((0.08, 0.0, -0.08), (0.24, 0.8, 0.08)),  # legs
    ((-0.24, 0.0, -0.08), (-0.08, 0.8, 0.08)),
)
WEB = ((0.24, 0.72, -0.08), (0.88, 1.2, 0.08))  # from the left arm to the trunk
LEFT_ARM, RIGHT_ARM = ("shoulder.L", "elbow.L", "wrist.L"), ("shoulder.R", "elbow.R", "wrist.R")
LEFT_LEG, RIGHT_LEG = ("hip.L", "knee.L", "ankle.L"), ("hip.R", "knee.R", "ankle.R")


def make_figure(*more: tuple[ArrayLike, ArrayLike], name: str = "figure") -> Character:
    """A closed blocky body with two arms and two legs, and `more` blocks to it."""
    vertices, faces = _bricks([*BLOCKS, *more])
    names = tuple(NODES)
    count = len(vertices)
    return Character(
        name=name,
        vertices=vertices,
        faces=faces,
        skeleton=Skeleton(
            names,
            np.array([names.index(parent) if parent else -1 for parent, _ in NODES.values()]),
            np.array([place for _, place in NODES.values()]),
        ),
        weights=None,
        surface=Surface(
            vertex=np.arange(count),
            faces=faces.astype(np.int32),
            colors=np.ones((count, 4), np.float32),
            uvs=None,
            materials=(Material(np.float32([0.6, 0.3, 0.1, 1.0])),),
            face_material=np.zeros(len(faces), dtype=np.int64),
        ),
        file_to_stage=np.eye(4),
    )


def _bricks(blocks: list[tuple[ArrayLike, ArrayLike]]) -> tuple[NDArray, NDArray]:
    """The surface of a heap of bricks that fills the blocks."""
    cells = np.stack(np.meshgrid(*[np.arange(-12, 24)] * 3, indexing="ij"), axis=-1)
    middles = (cells + 0.5) * BRICK
    full = np.zeros(cells.shape[:3], dtype=bool)
    for low, high in blocks:
        full |= ((middles > low) & (middles < high)).all(axis=-1)
    quads = []
    for axis in range(3):
        u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        for step in (1, -1):
            corners = cells[full & ~np.roll(full, -step, axis=axis)]
            corners = corners + (step > 0) * np.eye(3, dtype=int)[axis]
            around = [corners, corners + u, corners + u + v, corners + v]
            quads.append(np.stack(around if step > 0 else around[::-1], axis=1))
    points, index = np.unique(np.concatenate(quads).reshape(-1, 3), axis=0, return_inverse=True)
    quad = index.reshape(-1, 4)
    faces = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    return points * BRICK, faces.astype(np.int64)


def node(name: str) -> int:
    """Number of a node of the figure."""
    return list(NODES).index(name)


def drive(source: str, target: tuple[str, ...]) -> Drive:
    """A limb of the performer, e.g. "ArmLeft", that drives a chain of nodes."""
    limb, side = source[:3], source[3:]
    joints = {"Arm": ("Shoulder", "Elbow", "Wrist", "Hand"), "Leg": ("Hip", "Knee", "Ankle")}[limb]
    return Drive(tuple(BODY.index(j + side) for j in joints), tuple(map(node, target)))


ARMS = (drive("ArmLeft", LEFT_ARM), drive("ArmRight", RIGHT_ARM))
LEGS = (drive("LegLeft", LEFT_LEG), drive("LegRight", RIGHT_LEG))


def seen(positions: NDArray[np.float64]) -> Pose:
    """The pose of a performer of whom this is the first frame."""
    return Performer(BODY).follow(frame(positions))


def paired(puppet: Puppet) -> Pairing:
    """The puppet paired with the performer."""
    joints = tuple(range(len(BODY.names)))
    return Pairing(BODY, joints, puppet.character, puppet.bound_skeleton, puppet.surface)


def driven_by(puppet: Puppet, drives: Sequence[Drive], rest: Rest) -> PolylineDriver:
    """A new driver of a puppet, which these drives move from this rest state."""
    driver = PolylineDriver(paired(puppet))
    driver.show(Mapping(tuple(drives)), FRONT_VIEW)
    driver.prepare((), rest)
    puppet.drive_with(driver)
    return driver


def driven(puppet: Puppet, drives: Sequence[Drive]) -> Pose:
    """Let the drives of a performer who stands at rest drive a puppet that stands at rest."""
    puppet.rest()
    puppet.surface.reset()
    start = seen(pose())
    driven_by(puppet, drives, rest_state(start))
    return start


def perform(puppet: Puppet, poses: Sequence[NDArray[np.float64]]) -> list[Motion]:
    """Let a puppet follow a performer through poses, 30 a second."""
    performer, motions = Performer(BODY), []
    for number, positions in enumerate(poses):
        puppet.follow(performer.follow(frame(positions, number / 30.0)))
        motions.append(puppet.deform())
    return motions


def pose(
    turns: Turns[str, ArrayLike] | None = None,
    *,
    heading: float = 0.0,
    moved: ArrayLike = (0, 0, 0),
) -> NDArray[np.float64]:
    """Joints (J, 3) of the performer, some turned by rotation vectors [rad] from rest."""
    rest = BODY.rest_positions
    positions, rotations = rest.copy(), np.tile(np.eye(3), (len(rest), 1, 1))
    for joint in BODY.order:
        parent = int(BODY.parents[joint])
        if parent >= 0:
            rotations[joint] = rotations[parent]
            positions[joint] = positions[parent] + rotations[parent] @ (rest[joint] - rest[parent])
        own = (turns or {}).get(BODY.names[joint])
        if own is not None:
            rotations[joint] @= Rotation.from_rotvec(own).as_matrix()
    return turned(positions, heading, positions[HIPS]) + np.asarray(moved, dtype=np.float64)


T_POSE = {"ShoulderLeft": (0.0, 0.0, 0.75), "ShoulderRight": (0.0, 0.0, -0.75)}


def frame(
    positions: NDArray[np.float64], time: float = 0.0, *, performer: int = 0
) -> SkeletonFrame:
    """One capture; joints that are NaN were not seen."""
    seen = np.isfinite(positions).all(axis=1)
    return SkeletonFrame(time, positions, None, seen.astype(np.float64), performer)


def record(
    poses: list[NDArray[np.float64]], *, rate: float = 10.0, performers: ArrayLike | None = None
) -> Recording:
    """A recording of these poses, evenly spaced."""
    count = len(poses)
    positions = np.array(poses)
    return Recording(
        skeleton=BODY,
        times=np.arange(count) / rate,
        positions=positions,
        rotations=None,
        confidence=np.isfinite(positions).all(axis=2).astype(np.float64),
        performers=np.zeros(count, np.int64) if performers is None else np.asarray(performers),
        arrivals=np.full(count, np.nan),
    )


def waving(count: int) -> list[NDArray[np.float64]]:
    """Poses in which the left arm swings up and down again."""
    swing = np.sin(np.linspace(0.0, np.pi, count))
    return [pose({"ShoulderLeft": (0.0, 0.0, 1.2 * s), "ElbowLeft": (0.0, 0.0, s)}) for s in swing]
