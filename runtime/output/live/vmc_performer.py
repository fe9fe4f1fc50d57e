"""The tracked performer for other programs: a VMC performer that sends to a marionette.

Source: sh-akira/VirtualMotionCaptureProtocol, performer specification: per frame the root, the
bones, OK and the time, in bundles of at most 1500 bytes with their UDP and IP headers.
"""

from __future__ import annotations

import socket
import struct
from typing import Self

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
    """An output that sends the first performer's newest pose as VMC, whatever character follows it.

    A datagram that cannot be sent is gone, as UDP has it, and counted; a show never waits for
    who listens.

    Args:
        skeleton: of the performer; the protocol knows one performer at a port.
        host, port: where the marionette listens.

    Attributes:
        lost: datagrams that the system did not take.

    Raises:
        InputError: no host is called that, or the performer is no body with hips and legs.
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
        """Send the pose of the first performer at this frame."""
        pose = frame.poses[0]
        if pose is None:
            return
        self._began = frame.time if self._began is None else self._began
        offsets, turns = self._bones.local(pose.seen)
        rows = zip(across_unity(offsets).tolist(), turn_across_unity(turns).tolist(), strict=True)
        messages = [self._root]
        for head, (offset, turn) in zip(self._heads, rows, strict=True):
            messages.append(head + struct.pack(">7f", *offset, *turn))
        messages.append(write_message("/VMC/Ext/OK", "iii", 1, CALIBRATED, 0))
        messages.append(write_message("/VMC/Ext/T", "f", frame.time - self._began))
        for bundle in write_bundles(messages, LONGEST):
            try:
                self._socket.sendto(bundle, self._target)
            except OSError:  # nobody there, or the queue is full
                self.lost += 1

    def close(self) -> None:
        """Send no more; may be called twice."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


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
