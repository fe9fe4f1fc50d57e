"""Device ``nimate://127.0.0.1:7000``: depth-camera programs that send joints by UDP.

NI mate (port 7000), OSCeleton and Animata's puppets (7110), KinectV2-OSC, and skelecaster (11011).
The messages determine the sender; ``?format=nimate|osceleton|animata|kinect2|skelecaster`` accepts
only one. With kinect2 and skelecaster the skeleton has Kinect's 25 joints, else OpenNI's 15 and the
middle of the hips.

- NI mate: right-handed, Y up, the performer faces -Z; quaternions (w, x, y, z), world to joint, of
  a body in a T-pose; if only rotations come, forward kinematics places the joints.
  ``/NI_mate_sync`` ends a frame. Source: Delicode's documentation of OSC and skeleton tracking, and
  its plug-ins.
- OSCeleton: 2.56 m, 1.92 m and 1.28 m to the unit, mirrored or not. Source: its README and `-xr`.
- Animata: pictures, mirrored or not, any unit.
- KinectV2-OSC, skelecaster: metres in the camera's axes.

The units of the first three are unreliable: their torso gets the length of the built-in body's,
unless ``?scale=METRES`` states the unit. ``?joints=head,neck,...`` gives the order of the joints in
NI mate's Omni list, which has no names.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from urllib.parse import SplitResult

import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, one_of, options_of, positive
from devices.bodies.performer_numbers import PerformerNumbers
from devices.kinect.joints import KINECT_V2
from devices.osc.camera_bodies import CameraBody
from devices.osc.messages import Message, OscError, read_packet
from devices.osc.nimate_messages import JointFormat, JointMessage, read_joints
from devices.osc.openni_joints import OPENNI, joint_called, openni_choice
from devices.osc.skelecaster import HEAD, read_bodies
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.frame_assembly import FrameAssembly
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport
from solvers.skeleton.quaternions import rotate

Array = NDArray[np.float64]

PORT = 7000
SKELECASTER = "skelecaster"
FORMATS = (*(str(format) for format in JointFormat), SKELECASTER)
MOST_USERS = 16
PRESENT = 0.1  # [s] without a frame, after which another id may take a user's number
GONE = 5.0  # [s] after which a user is forgotten
SYNCED = 1.0  # [s] after NI mate's mark in which frames are expected to end with one
AGAIN = 0.004  # [s] within which an equal datagram is a duplicate made by the network
INFERRED = 0.3  # confidence of a joint that is derived from others

_COUNT = len(KINECT_V2.names)
_SYNC = {"/NI_mate_sync", "NI_mate_sync"}
_LOST = "/lost_user"
# Inverts NI mate's rotation, world to joint, and turns it half about Y with the body.
_TURN = np.array([1.0, -1.0, 1.0, 1.0])


@dataclass(slots=True, eq=False)
class _User:
    """State of one user: the frame being assembled and the converter of its body."""

    body: CameraBody
    assembly: FrameAssembly = field(default_factory=FrameAssembly)
    positions: Array = field(default_factory=lambda: np.full((_COUNT, 3), np.nan))
    rotations: Array = field(default_factory=lambda: np.full((_COUNT, 4), np.nan))
    format: JointFormat = JointFormat.NIMATE
    place: Array = field(default_factory=lambda: np.full(3, np.nan))
    heard: float = -math.inf


class NimateDecoder:
    """Frames of all users that one sender reports; frame times are arrivals, as none are sent.

    Args:
        format: of `FORMATS`; None to detect it.
        scale: [m] of the sender's unit; None to derive it from the torso where it is unknown.
        omni: the joints of NI mate's Omni list, as indices of KINECT_V2; empty to derive the order
            from their number.

    Attributes:
        refused: datagrams and messages that were malformed, repeated, or of one user too many.
    """

    def __init__(
        self, format: str | None = None, *, scale: float | None = None, omni: Sequence[int] = ()
    ) -> None:
        self.refused = 0
        self._format = format
        self._only = JointFormat(format) if format in list(JointFormat) else None
        self._scale = scale
        self._omni = omni
        self._kinect = format in (JointFormat.KINECT, SKELECASTER)
        self._users: dict[int, _User] = {}
        self._numbers = PerformerNumbers()
        self._synced = -math.inf
        self._last: tuple[bytes, float] = b"", -math.inf

    @property
    def skeleton(self) -> Skeleton:
        """Kinect's joints for formats that have only those, else OpenNI's."""
        return KINECT_V2 if self._kinect else OPENNI

    @np.errstate(over="ignore", invalid="ignore")  # values of a damaged packet
    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frames that a datagram, received at `arrival` [s], completes."""
        repeated = data == self._last[0] and arrival - self._last[1] < AGAIN
        self._last = data, arrival
        if repeated:
            self.refused += 1
            return ()
        if self._format == SKELECASTER or (self._format is None and data.startswith(HEAD)):
            return self._cast(data, arrival)
        try:
            messages = read_packet(data)
        except OscError:
            self.refused += 1
            return ()
        return self._take_in(messages, arrival)

    def _cast(self, data: bytes, arrival: float) -> list[SkeletonFrame]:
        bodies = read_bodies(data)
        if bodies is None:
            self.refused += 1
            return []
        frames = []
        for cast in bodies:
            user = self._user(cast.id, arrival)
            if user is not None:
                user.format = JointFormat.KINECT
                near = (np.abs(cast.positions) < 100.0).all(axis=1) & (cast.confidence > 0.0)
                user.positions[near] = cast.positions[near]
                frames.append(self._frame(cast.id, user, arrival, cast.confidence))
        return frames

    def _take_in(self, messages: Sequence[Message], arrival: float) -> list[SkeletonFrame]:
        frames = [
            self._finish(number, user)
            for number, user in list(self._users.items())
            if user.assembly.overdue(arrival)
        ]
        for message in messages:
            if message.address in _SYNC:
                self._synced = arrival
                frames += self._finish_all()
            elif message.address == _LOST and message.tags == "i":
                self._users.pop(int(message.arguments[0] or 0), None)
            else:
                frames += self._hear(message, arrival)
        if arrival - self._synced > SYNCED:
            frames += [
                self._finish(number, user)
                for number, user in self._users.items()
                if user.assembly.parts and user.assembly.whole
            ]
        return frames

    def _hear(self, message: Message, arrival: float) -> list[SkeletonFrame]:
        """Add a joint message; return the frames that end because their joints repeat."""
        joints = read_joints(message, self._only, self._omni)
        if joints is None:
            self.refused += 1
            return []
        frames = []
        for joint in joints:
            user = self._user(joint.user, arrival)
            if user is None:
                continue
            part = 2 * joint.joint + (joint.position is None)
            if part in user.assembly.parts:
                if _same(user, joint):
                    self.refused += 1
                    continue
                frames.append(self._finish(joint.user, user))
            user.assembly.add(part, arrival)
            user.format = joint.format
            if joint.position is not None:
                user.positions[joint.joint] = joint.position
            if joint.rotation is not None:
                user.rotations[joint.joint] = joint.rotation
        return frames

    def _user(self, number: int, arrival: float) -> _User | None:
        """The user with that number; None if there are too many."""
        if number not in self._users:
            for gone in [n for n, u in self._users.items() if arrival - u.heard > GONE]:
                del self._users[gone]
            if len(self._users) >= MOST_USERS:
                self.refused += 1
                return None
            self._users[number] = _User(CameraBody(self._scale))
        user = self._users[number]
        user.heard = arrival
        return user

    def _finish_all(self) -> list[SkeletonFrame]:
        return [
            self._finish(number, user)
            for number, user in self._users.items()
            if user.assembly.parts
        ]

    def _finish(self, number: int, user: _User) -> SkeletonFrame:
        """End the frame being assembled."""
        arrival = user.assembly.newest
        user.assembly.end()
        return self._frame(number, user, arrival, np.ones(_COUNT))

    def _frame(self, number: int, user: _User, arrival: float, sure: Array) -> SkeletonFrame:
        """Make a frame of a user's current joints, and clear them."""
        positions, rotations = user.body.place(user.positions, user.format), user.rotations * _TURN
        user.positions, user.rotations = np.full((_COUNT, 3), np.nan), np.full((_COUNT, 4), np.nan)
        if not self._kinect:
            chosen = openni_choice(~np.isnan(positions[:, 0]))
            turned = openni_choice(~np.isnan(rotations[:, 0]))
            positions, rotations, sure = positions[chosen], rotations[turned], sure[chosen]
        seen = ~np.isnan(positions[:, 0])
        confidence = np.where(seen, np.maximum(sure, INFERRED), 0.0)
        if not seen.any() and not self._kinect:
            positions, confidence = _by_rotations(rotations)
        user.place = np.nanmean(positions, axis=0) if (confidence > 0.0).any() else user.place
        return SkeletonFrame(
            time=arrival,
            positions=positions,
            rotations=None if np.isnan(rotations).all() else rotations,
            confidence=confidence,
            performer=self._number(number, arrival),
            arrival=arrival,
        )

    def _number(self, number: int, arrival: float) -> int:
        """The performer number of a user, among all present users."""
        there = {
            other: user.place
            for other, user in self._users.items()
            if other == number or arrival - user.heard < PRESENT
        }
        return self._numbers(there)[number]


def _same(user: _User, joint: JointMessage) -> bool:
    """Whether a joint is a repetition rather than part of the next frame."""
    if joint.position is not None:
        return bool((user.positions[joint.joint] == joint.position).all())
    return bool((user.rotations[joint.joint] == joint.rotation).all())


def _by_rotations(rotations: Array) -> tuple[Array, Array]:
    """Joints (16, 3) [m] of a T-pose turned by world rotations (16, 4), and their confidence.

    A joint without a rotation turns with its parent.
    """
    turns, positions = rotations.copy(), np.array(OPENNI.rest_positions)
    for joint in OPENNI.order:
        above = int(OPENNI.parents[joint])
        if np.isnan(turns[joint]).any():
            turns[joint] = turns[above] if above >= 0 else (0.0, 0.0, 0.0, 1.0)
        if above >= 0:
            bone = OPENNI.rest_positions[joint] - OPENNI.rest_positions[above]
            positions[joint] = positions[above] + rotate(turns[above], bone)
    return positions, np.where(np.isnan(rotations[:, 0]), INFERRED, 1.0)


def _omni_order(text: str) -> tuple[int, ...]:
    """Parse ``NAME,NAME,...``."""
    joints = [joint_called(name) for name in text.split(",")]
    known = tuple(joint for joint in joints if joint is not None)
    if len(known) < len(joints) or len(set(known)) < len(known):
        raise ValueError("expected names of different joints, such as head,neck,left_hand")
    return known


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``nimate://HOST:PORT?format=FORMAT&scale=METRES&joints=NAME,...``.

    Raises:
        InputError: the port is taken, or an option is unknown.
    """
    options = options_of(
        address, {"format": one_of(*FORMATS), "scale": positive, "joints": _omni_order}
    )
    host, port = host_and_port(address, PORT)
    transport = UdpTransport(host, port, scheme=address.scheme)
    return LiveStream(
        transport,
        lambda: NimateDecoder(
            options.get("format"), scale=options.get("scale"), omni=options.get("joints", ())
        ),
    )
