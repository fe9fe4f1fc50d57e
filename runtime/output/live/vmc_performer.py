"""Output of the first performer as VMC: the VMC role "performer", which sends to a "marionette".

Source: sh-akira/VirtualMotionCaptureProtocol, performer specification: per frame the root, the
bones, the blend shapes of a face if there is one, OK and the time, in bundles of at most 1500 bytes
with their UDP and IP headers.
"""

from __future__ import annotations

import socket
import struct
from typing import Self

from devices.blend_shapes import Blends
from devices.bodies.unity_space import across_unity, turn_across_unity
from devices.errors import InputError
from devices.osc.messages import write_bundles, write_message
from devices.skeleton import Skeleton
from runtime.output.live.humanoid_bones import HumanoidBones
from runtime.output.output import PerformedFrame

PORT = 39539
LONGEST = 1500 - 20 - 8  # bytes of a bundle in an Ethernet packet
CALIBRATED = 3
_POSE = "sfffffff"
_UNMOVED = (0.0,) * 6 + (1.0,)


class VmcPerformer:
    """Sends the newest pose of the first performer as VMC, independent of the characters.

    A datagram that cannot be sent is lost and counted; a show never waits for a receiver.

    Args:
        skeleton: the performer's; the protocol has one performer per port.
        host, port: the address of the marionette.

    Attributes:
        lost: datagrams that the system did not accept.

    Raises:
        InputError: the host is unknown, or the performer has no hips and legs.
    """

    pictures_a_second = 0.0

    def __init__(self, skeleton: Skeleton, host: str, port: int = PORT) -> None:
        self.lost = 0
        self._bones = HumanoidBones(skeleton)
        self._heads = [
            write_message("/VMC/Ext/Bone/Pos", _POSE, name, *_UNMOVED)[:-28]
            for name in self._bones.names
        ]
        self._root = write_message("/VMC/Ext/Root/Pos", _POSE, "root", *_UNMOVED)
        self._began: float | None = None
        self._socket, self._target = _socket_to(host, port)

    def write(self, frame: PerformedFrame) -> None:
        """Send the first performer's pose of this frame."""
        pose = frame.poses[0]
        if pose is None:
            return
        self._began = frame.time if self._began is None else self._began
        offsets, turns = self._bones.local(pose.seen)
        rows = zip(across_unity(offsets).tolist(), turn_across_unity(turns).tolist(), strict=True)
        messages = [self._root]
        for head, (offset, turn) in zip(self._heads, rows, strict=True):
            messages.append(head + struct.pack(">7f", *offset, *turn))
        if pose.blends is not None:
            messages += _face(pose.blends)
        messages.append(write_message("/VMC/Ext/OK", "iii", 1, CALIBRATED, 0))
        messages.append(write_message("/VMC/Ext/T", "f", frame.time - self._began))
        for bundle in write_bundles(messages, LONGEST):
            try:
                self._socket.sendto(bundle, self._target)
            except OSError:  # no receiver, or the queue is full
                self.lost += 1

    def close(self) -> None:
        """Stop sending; may be called twice."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _face(blends: Blends) -> list[bytes]:
    """The messages that set every blend shape, under the names that its source gave it."""
    values = [
        write_message("/VMC/Ext/Blend/Val", "sf", name, weight) for name, weight in blends.items()
    ]
    return [*values, write_message("/VMC/Ext/Blend/Apply", "")]


def _socket_to(host: str, port: int) -> tuple[socket.socket, tuple[str, int]]:
    try:
        family, _, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, UnicodeError):
        raise InputError(
            f"cannot send VMC to {host}:{port}: no host is called {host!r}; "
            "give the address of the machine that listens"
        ) from None
    sending = socket.socket(family, socket.SOCK_DGRAM)
    sending.setblocking(False)
    return sending, (str(target[0]), int(target[1]))
