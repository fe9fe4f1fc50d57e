"""The Virtual Motion Capture protocol, version 3.1: what VTuber programs send each other.

``vmc://127.0.0.1:39539`` receives a performer's model, as a Marionette does: local poses of Unity's
humanoid bones. ``vmc://127.0.0.1:39540?role=performer`` receives what assistants send a performer:
poses of headset, controllers and trackers, and single bones. OSC over UDP, one way.

Source: sh-akira/VirtualMotionCaptureProtocol, marionette and performer specifications.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import SplitResult

import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, one_of, options_of, positive
from devices.bodies.humanoid_kernels import FARTHEST, read_bones
from devices.bodies.humanoid_pose import COUNT, SKELETON, HumanoidPose
from devices.bodies.joint_names import Kind, Side, part_of_name
from devices.bodies.unity_space import across_unity, turn_across_unity
from devices.errors import InputError
from devices.osc.layouts import Layouts, Span
from devices.osc.messages import Message, OscError, elements, read_message
from devices.skeleton import SkeletonFrame
from devices.transport.clock_map import STEP_BACK, ClockMap
from devices.transport.frame_assembly import FrameAssembly
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

MARIONETTE, PERFORMER = "marionette", "performer"
PORTS = {MARIONETTE: 39539, PERFORMER: 39540}
MOST_EXPRESSIONS = 512
FEWEST_IN_A_RUN = 4  # bones that are worth reading together

_BONES = {name: joint for joint, name in enumerate(SKELETON.names)}
_BONES_ANY_CASE = {name.lower(): joint for name, joint in _BONES.items()}
_BONE = "/VMC/Ext/Bone/Pos"
_POSE = "sfffffff"
_POSE_BYTES = 28
_TRACKED = {
    Kind.HEAD: "Head",
    Kind.NECK: "Neck",
    Kind.CHEST: "Chest",
    Kind.SPINE: "Spine",
    Kind.HIPS: "Hips",
    Kind.UPPER_ARM: "UpperArm",
    Kind.LOWER_ARM: "LowerArm",
    Kind.HAND: "Hand",
    Kind.UPPER_LEG: "UpperLeg",
    Kind.LOWER_LEG: "LowerLeg",
    Kind.FOOT: "Foot",
    Kind.TOES: "Toes",
}

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Messages of a packet, one after the other, that each tell a bone's pose, none of them twice.

    Attributes:
        joints: (n,) of the bones.
        places: (n,) where in the packet the seven numbers of each begin.
        parts: the joints as a set.
        spans: where each message begins and ends.
    """

    joints: Indices
    places: Indices
    parts: frozenset[int]
    spans: tuple[Span, ...]


Plan = tuple[Run | Span, ...]
"""What a packet holds, in order: runs of bones, and where each other message is."""


class VmcDecoder:
    """Frames of one sender's messages.

    Args:
        role: whose messages are understood: MARIONETTE hears a performer, PERFORMER assistants.
        trackers: the bone that each tracker is on, by serial; others are told by their names.
        tpose: the pose so many seconds after the first frame is the model's T-pose; None for a
            model whose bones have the world's axes at rest, as those of VRM 0.

    Attributes:
        refused: datagrams and messages that were malformed, late or beyond belief.
        expressions: weights of the face's expressions, as committed by the sender.
        layouts: of the packets with many bones; what differs from them is read message by message.
    """

    skeleton = SKELETON

    def __init__(
        self,
        role: str = MARIONETTE,
        *,
        trackers: Mapping[str, int] | None = None,
        tpose: float | None = None,
    ) -> None:
        self.refused = 0
        self.expressions: Mapping[str, float] = {}
        self.layouts: Layouts[Plan] = Layouts()
        self._pose = HumanoidPose()
        self._assembly = FrameAssembly()
        self._clock = ClockMap()
        self._time = math.nan  # the sender's, of the frame that is being put together
        self._time_came = math.nan
        self._time_used = False
        self._valid = True
        self._tracking = True
        self._weights: dict[str, float] = {}
        self._trackers = dict(trackers or {})
        self._tpose = tpose
        self._first: float | None = None
        self._last: tuple[float, bytes] | None = None
        self._frames: list[SkeletonFrame] = []
        self._closing = self._has_parts = self._rooted = False
        self._handlers = self._of_role(role)
        nobody = np.zeros(0, dtype=np.int64)
        self._read_run(
            Run(nobody, nobody, frozenset(), ()), b""
        )  # compiled before the first packet

    def _of_role(self, role: str) -> dict[str, Callable[[Message, float], bool]]:
        handlers: dict[str, Callable[[Message, float], bool]] = {
            _BONE: self._bone,
            "/VMC/Ext/T": self._take_time,
            "/VMC/Ext/OK": self._status,
            "/VMC/Ext/Blend/Val": self._blend,
            "/VMC/Ext/Blend/Apply": self._apply,
        }
        if role == PERFORMER:
            return handlers | dict.fromkeys(
                (f"/VMC/Ext/{device}/Pos" for device in ("Hmd", "Con", "Tra")), self._tracker
            )
        return handlers | {"/VMC/Ext/Root/Pos": self._root}

    def calibrate(self) -> None:
        """Take the present pose for the model's T-pose."""
        self._pose.calibrate()

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """The frames that a datagram, which came at `arrival` [s], completes."""
        try:
            items = self._read(data)
        except OscError:
            self.refused += 1
            return ()
        if self._late(items, arrival):
            self.refused += 1
            return ()
        self._frames = []
        self._closing = self._has_parts = False
        if self._assembly.overdue(arrival):
            self._finish()
        for item in items:
            if isinstance(item, Message):
                self._take(item, arrival)
            else:
                self._take_run(item, data, arrival)
        if self._has_parts and (self._closing or self._assembly.whole):
            self._finish()
        return self._frames

    def _read(self, data: bytes) -> Sequence[Message | Run]:
        """What a packet holds: runs of bones where its layout is known, and messages."""
        plan = self.layouts.find(data)
        if plan is not None:
            return [one if isinstance(one, Run) else read_message(data, *one) for one in plan]
        said = [(span, read_message(data, *span)) for span in elements(data)]
        plan = tuple(_planned(said))
        if any(isinstance(one, Run) for one in plan):
            self.layouts.learn(data, said, plan)
        return [message for _, message in said]

    def _late(self, items: Sequence[Message | Run], arrival: float) -> bool:
        """Whether a datagram was overtaken by a newer one, just now."""
        if not arrival - self._time_came <= STEP_BACK:
            return False  # the sender's clock was set back a little, or stands
        for item in items:
            if not isinstance(item, Message):
                continue
            if item.address == "/VMC/Ext/T" and item.tags[:1] == "f":
                time = item.arguments[0]
                assert isinstance(time, float)
                return 0.0 < self._time - time <= STEP_BACK
        return False

    def _take(self, message: Message, arrival: float) -> None:
        handler = self._handlers.get(message.address)
        if handler is not None and not handler(message, arrival):
            self.refused += 1

    def _take_run(self, run: Run, data: bytes, arrival: float) -> None:
        """Take many bones at once; one by one where one is refused or begins another frame."""
        bones = self._pose.bones
        if self._assembly.parts.isdisjoint(run.parts) and self._read_run(run, data):
            bones.sent[run.joints] = bones.fresh[run.joints] = True
            self._assembly.add_all(run.parts, arrival)
            self._has_parts = True
            return
        for span in run.spans:
            self._take(read_message(data, *span), arrival)

    def _read_run(self, run: Run, data: bytes) -> bool:
        packet, bones = np.frombuffer(data, np.uint8), self._pose.bones
        return read_bones(packet, run.places, run.joints, bones.positions, bones.rotations)

    # What each message does; False where it is refused.

    def _bone(self, message: Message, arrival: float) -> bool:
        if not message.tags.startswith(_POSE):
            return False
        name, *numbers = message.arguments[:8]
        joint = _bone_called(str(name))
        if joint is None:
            return True  # LastBone, or one of a later version
        pose = _checked(numbers)  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        self._begin(joint, arrival)
        bones = self._pose.bones
        bones.positions[joint], bones.rotations[joint] = pose
        bones.sent[joint] = True
        return True

    def _root(self, message: Message, arrival: float) -> bool:
        if not message.tags.startswith(_POSE):
            return False
        pose = _checked(message.arguments[1:8])  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        if self._rooted and self._assembly.parts:
            self._finish()
        root = self._pose.bones.root
        root[:3], root[3:] = pose
        self._rooted = True
        return True

    def _tracker(self, message: Message, arrival: float) -> bool:
        if not message.tags.startswith(_POSE):
            return False
        pose = _checked(message.arguments[1:8])  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        joint = self._on_bone(message.address, str(message.arguments[0]))
        if joint is None:
            return True  # a tracker that nobody said the place of
        self._begin(COUNT + joint, arrival)
        bones = self._pose.bones
        bones.pinned[joint] = True
        bones.pinned_positions[joint], bones.pinned_rotations[joint] = pose
        return True

    def _on_bone(self, address: str, serial: str) -> int | None:
        if serial in self._trackers:
            return self._trackers[serial]
        if address == "/VMC/Ext/Hmd/Pos":
            return _BONES["Head"]
        return bone_of_tracker(serial)

    def _take_time(self, message: Message, arrival: float) -> bool:
        if not message.tags.startswith("f"):
            return False
        time = message.arguments[0]
        assert isinstance(time, float)
        if not math.isfinite(time):
            return False
        self._mark()
        if self._time - time > STEP_BACK:
            self._restart()
        if time != self._time:
            self._time, self._time_came, self._time_used = time, arrival, False
        return True

    def _status(self, message: Message, arrival: float) -> bool:
        tags, arguments = message.tags, message.arguments
        if not tags.startswith("i"):
            return False
        self._mark()
        self._valid = arguments[0] != 0
        self._tracking = not tags.startswith("iiii") or arguments[3] != 0
        return True

    def _blend(self, message: Message, arrival: float) -> bool:
        if not message.tags.startswith("sf"):
            return False
        name, value = message.arguments[:2]
        assert isinstance(name, str)
        assert isinstance(value, float)
        full = len(self._weights) >= MOST_EXPRESSIONS and name not in self._weights
        if full or not math.isfinite(value):
            return False
        self._weights[name] = value
        return True

    def _apply(self, message: Message, arrival: float) -> bool:
        self.expressions, self._weights = self._weights, {}
        return True

    # How they become frames.

    def _mark(self) -> None:
        """Time or status: parts before it in this datagram belong to it; earlier ones are over."""
        if self._has_parts:
            self._closing = True
        elif self._assembly.parts:
            self._finish()

    def _begin(self, part: int, arrival: float) -> None:
        if part in self._assembly.parts:
            self._finish()
        self._assembly.add(part, arrival)
        self._pose.bones.fresh[part % COUNT] = True
        self._has_parts = True

    def _restart(self) -> None:
        """The sender began again, perhaps with another model; only what just came is its."""
        bones, fresh = self._pose.bones, self._pose.bones.fresh.copy()
        current = [part for part in self._assembly.parts if part < COUNT]
        kept = bones.positions[current], bones.rotations[current]
        self._pose.forget()
        bones.positions[current], bones.rotations[current] = kept
        bones.sent[current] = True
        bones.fresh[:] = fresh
        self._assembly.restart()
        self._last = None

    def _finish(self) -> None:
        """End the frame that was being put together, and give it unless it came before."""
        assembly = self._assembly
        arrival = assembly.newest
        self._closing = self._rooted = False
        if self._repeated(arrival):
            assembly.discard()
            self.refused += 1
        else:
            assembly.end()
            device = self._time
            if self._time_used:  # the clock is told less often than bones are
                device += arrival - self._time_came
            if self._valid:
                self._give(device, arrival)
        self._pose.bones.fresh[:] = False

    def _give(self, device: float, arrival: float) -> None:
        """Give the frame that the sender's clock [s] says was at `device`."""
        self._time_used = True
        self._calibrate_when_due(arrival)
        positions, rotations, confidence = self._pose.world(tracking=self._tracking)
        self._frames.append(
            SkeletonFrame(
                time=self._clock.host_time(device, arrival),
                positions=positions,
                rotations=rotations,
                confidence=confidence,
                arrival=arrival,
            )
        )

    def _repeated(self, arrival: float) -> bool:
        """Whether the network brought the last frame again: the same pose and time, at once."""
        content = self._pose.content + struct.pack("d", self._time)
        last = self._last
        if last is not None and last[1] == content and arrival - last[0] < self._assembly.gap:
            return True
        self._last = arrival, content
        return False

    def _calibrate_when_due(self, arrival: float) -> None:
        if self._first is None:
            self._first = arrival
        if self._tpose is not None and arrival - self._first >= self._tpose:
            self._pose.calibrate()
            self._tpose = None


def _bone_called(name: str) -> int | None:
    joint = _BONES.get(name)
    return _BONES_ANY_CASE.get(name.lower()) if joint is None else joint


def _planned(said: Sequence[tuple[Span, Message]]) -> Iterator[Run | Span]:
    """Runs of bones, as long as there are some, and the other messages by themselves."""
    run: dict[int, Span] = {}
    for span, message in said:
        joint = None
        if message.address == _BONE and message.tags == _POSE:
            joint = _bone_called(str(message.arguments[0]))
        if joint is None or joint in run:
            yield from _as_run(run)
            run = {}
        if joint is None:
            yield span
        else:
            run[joint] = span
    yield from _as_run(run)


def _as_run(bones: Mapping[int, Span]) -> Iterator[Run | Span]:
    if len(bones) < FEWEST_IN_A_RUN:
        yield from bones.values()
        return
    joints = np.array(list(bones), dtype=np.int64)
    places = np.array([end - _POSE_BYTES for _, end in bones.values()], dtype=np.int64)
    yield Run(joints, places, frozenset(bones), tuple(bones.values()))


def _checked(numbers: Sequence[float]) -> tuple[Array, Array] | None:
    """Position and unit quaternion in our space; None where no body can have them."""
    px, py, pz, x, y, z, w = numbers
    if not abs(px) + abs(py) + abs(pz) < FARTHEST:  # NaN is not
        return None
    square = x * x + y * y + z * z + w * w
    if not 0.25 < square < 4.0:
        return None
    turn = turn_across_unity((x, y, z, w)) / math.sqrt(square)
    return across_unity((px, py, pz)), turn


def bone_of_tracker(serial: str) -> int | None:
    """The bone that a tracker's name says it is on ("waist", "LeftFoot"); None if it says none."""
    part = part_of_name(serial) if len(serial) <= 64 else None
    if part is None or part.kind not in _TRACKED:
        return None
    side = "" if part.side is Side.CENTRE else part.side.value.capitalize()
    return _BONES.get(side + _TRACKED[part.kind])


def _bones_of_trackers(text: str) -> dict[str, int]:
    """Reads ``SERIAL:BONE,SERIAL:BONE``."""
    trackers: dict[str, int] = {}
    for pair in text.split(","):
        serial, colon, bone = pair.rpartition(":")
        if not colon or bone not in _BONES:
            raise ValueError("expected SERIAL:BONE,... with bones such as Hips or LeftFoot")
        trackers[serial] = _BONES[bone]
    return trackers


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``vmc://HOST:PORT?role=marionette|performer&trackers=SERIAL:BONE,...&tpose=SECONDS``.

    Raises:
        InputError: the port is taken, or an option is not known.
    """
    options = options_of(
        address,
        {
            "role": one_of(MARIONETTE, PERFORMER),
            "trackers": _bones_of_trackers,
            "tpose": positive,
        },
    )
    role = options.get("role", MARIONETTE)
    if "trackers" in options and role != PERFORMER:
        raise InputError("trackers come to a performer only; add role=performer to the address")
    if "tpose" in options and role == PERFORMER:
        raise InputError("trackers have no T-pose; leave tpose out with role=performer")
    host, port = host_and_port(address, PORTS[role])
    transport = UdpTransport(host, port, scheme=address.scheme)
    return LiveStream(
        transport,
        lambda: VmcDecoder(role, trackers=options.get("trackers"), tpose=options.get("tpose")),
    )
