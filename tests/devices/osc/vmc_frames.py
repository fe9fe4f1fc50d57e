"""A waving body as VMC senders write it, and a decoder that is fed their datagrams."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import SEGMENTS
from devices.osc.vmc_decoder import VmcDecoder
from devices.skeleton import SkeletonFrame
from tests.devices.vmc_sender import HUMAN, at, bones, bundle, message, ok, root

REST = HUMAN.rest_positions
STEP = 1 / 60
CORE = [name for name in HUMAN.names if not name.endswith(SEGMENTS)]


def joint(name: str) -> int:
    return HUMAN.index(name)


def waving(k: int) -> dict[str, Rotation]:
    """Local rotations that differ from frame to frame, in our own space."""
    return {
        "Hips": Rotation.from_euler("y", 0.2 * k),
        "LeftUpperArm": Rotation.from_euler("z", 0.1 * k),
        "LeftLowerArm": Rotation.from_euler("y", -0.3),
        "Spine": Rotation.from_euler("x", 0.05 * k),
        "RightLowerArm": Rotation.from_euler("y", 0.1 * k),
    }


def fed(decoder: VmcDecoder, datagrams: Sequence[tuple[float, bytes]]) -> list[SkeletonFrame]:
    return [frame for at_, data in datagrams for frame in decoder.feed(data, at_)]


def official(k: int, turns: dict[str, Rotation]) -> list[bytes]:
    """The order of the protocol's own sample: root, bones, trackers, blend shapes, OK, T."""
    return [
        root().dgram,
        bundle(bones(turns)[:30]),
        bundle(bones(turns)[30:]),
        bundle([message("/VMC/Ext/Tra/Pos", "LHR-1", *([0.0] * 6), 1.0)]),
        bundle([message("/VMC/Ext/Blend/Val", "Joy", 0.1 * k), message("/VMC/Ext/Blend/Apply")]),
        ok(1, 3, 0, 1).dgram,
        at(k * STEP).dgram,
    ]


def bare(k: int, turns: dict[str, Rotation]) -> list[bytes]:
    """Each message in a datagram of its own, and neither status nor time."""
    return [one.dgram for one in [root(), *bones(turns)]]
