"""Makes a rest pose for a body whose file has none: a T-pose with its own bone lengths."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from devices.bodies.skeleton_on_humanoid import JointOnHumanoid, skeleton_on_humanoid
from devices.skeleton import Skeleton

Array = NDArray[np.float64]


def t_pose_of(points: Mapping[str, JointOnHumanoid], tracks: Mapping[str, Array]) -> Skeleton:
    """Return joints in a T-pose, +Y up, facing +Z, each bone of its median length.

    Args:
        points: the place of each joint on the humanoid, in the order of the skeleton; its parent
            comes before it.
        tracks: positions (T, 3) of each joint, in any unit and axes; NaN where not seen.
    """
    human = skeleton_on_humanoid(points)
    rest = np.zeros((len(human.names), 3))
    for joint, name in enumerate(human.names):
        parent = int(human.parents[joint])
        if parent < 0:
            continue
        bone = human.rest_positions[joint] - human.rest_positions[parent]
        lengths = np.linalg.norm(tracks[name] - tracks[human.names[parent]], axis=1)
        lengths = lengths[np.isfinite(lengths)]
        usual = float(np.median(lengths)) if lengths.size else 0.0
        rest[joint] = rest[parent] + bone * (usual / max(float(np.linalg.norm(bone)), 1e-9))
    return Skeleton(human.names, human.parents, rest)
