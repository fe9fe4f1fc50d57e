"""Decode Virtual Motion Capture (VMC) messages of one sender to frames of the humanoid."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from devices.blend_shapes import MOST_BLENDS, Blends, blend_weight
from devices.bodies.humanoid_kernels import read_bones
from devices.bodies.humanoid_pose import COUNT, SKELETON, HumanoidPose
from devices.osc.layouts import Layouts
from devices.osc.messages import Message, OscError, elements, read_message
from devices.osc.vmc_packets import (
    BONE_ADDRESS,
    BONES,
    POSE_TAGS,
    Plan,
    Run,
    bone_called,
    checked_pose,
    plan_packet,
)
from devices.osc.vmc_trackers import bone_of_tracker
from devices.skeleton import SkeletonFrame
from devices.transport.clock_map import STEP_BACK, ClockMap
from devices.transport.frame_assembly import FrameAssembly

MARIONETTE, PERFORMER = "marionette", "performer"
"""Roles of the protocol: a marionette receives a performer's pose, a performer receives devices."""


class VmcDecoder:
    """Frames of one sender's messages.

    Args:
        role: MARIONETTE accepts messages of a performer, PERFORMER those of assistants.
        trackers: the bone of each tracker, by serial; other trackers are placed by their names.
        tpose: seconds after the first frame at which the pose is the model's T-pose; None for a
            model whose bones have the world's axes at rest, as in VRM 0.

    Attributes:
        refused: datagrams and messages that were malformed, late or implausible.
        expressions: weights in [0, 1] of the face's expressions, as committed by the sender; one
            that is not sent again keeps its weight.
        layouts: of the packets with many bones; other packets are read message by message.
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
        self.expressions: Blends = {}
        self.layouts: Layouts[Plan] = Layouts()
        self._pose = HumanoidPose()
        self._assembly = FrameAssembly()
        self._clock = ClockMap()
        self._time = math.nan  # the sender's time of the frame being assembled
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
        none = np.zeros(0, dtype=np.int64)
        self._read_run(Run(none, none, frozenset(), ()), b"")  # compile before the first packet

    def _of_role(self, role: str) -> dict[str, Callable[[Message, float], bool]]:
        handlers: dict[str, Callable[[Message, float], bool]] = {
            BONE_ADDRESS: self._bone,
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
        """Take the current pose as the model's T-pose."""
        self._pose.calibrate()

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frames that a datagram, received at `arrival` [s], completes."""
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
        """The contents of a packet: runs of bones if its layout is known, and messages."""
        plan = self.layouts.find(data)
        if plan is not None:
            return [one if isinstance(one, Run) else read_message(data, *one) for one in plan]
        messages = [(span, read_message(data, *span)) for span in elements(data)]
        plan = tuple(plan_packet(messages))
        if any(isinstance(one, Run) for one in plan):
            self.layouts.learn(data, messages, plan)
        return [message for _, message in messages]

    def _late(self, items: Sequence[Message | Run], arrival: float) -> bool:
        """Whether a newer datagram came just before this one."""
        if not arrival - self._time_came <= STEP_BACK:
            return False  # the sender's clock was set back a little, or is constant
        for item in items:
            if not isinstance(item, Message):
                continue
            if item.address == "/VMC/Ext/T" and item.begins("f"):
                time = float(item.arguments[0])  # type: ignore[arg-type]  # a number, by its tag
                return 0.0 < self._time - time <= STEP_BACK
        return False

    def _take(self, message: Message, arrival: float) -> None:
        handler = self._handlers.get(message.address)
        if handler is not None and not handler(message, arrival):
            self.refused += 1

    def _take_run(self, run: Run, data: bytes, arrival: float) -> None:
        """Take many bones at once; one by one if one is refused or begins another frame."""
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

    # Handlers of the messages; they return False for a refused message.

    def _bone(self, message: Message, arrival: float) -> bool:
        if not message.begins(POSE_TAGS):
            return False
        name, *numbers = message.arguments[:8]
        joint = bone_called(str(name))
        if joint is None:
            return True  # LastBone, or a bone of a later version
        pose = checked_pose(numbers)  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        self._begin(joint, arrival)
        bones = self._pose.bones
        bones.positions[joint], bones.rotations[joint] = pose
        bones.sent[joint] = True
        return True

    def _root(self, message: Message, arrival: float) -> bool:
        if not message.begins(POSE_TAGS):
            return False
        pose = checked_pose(message.arguments[1:8])  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        if self._rooted and self._assembly.parts:
            self._finish()
        root = self._pose.bones.root
        root[:3], root[3:] = pose
        self._rooted = True
        return True

    def _tracker(self, message: Message, arrival: float) -> bool:
        if not message.begins(POSE_TAGS):
            return False
        pose = checked_pose(message.arguments[1:8])  # type: ignore[arg-type]  # `_checked` refuses what is no number
        if pose is None:
            return False
        joint = self._on_bone(message.address, str(message.arguments[0]))
        if joint is None:
            return True  # a tracker whose bone is unknown
        self._begin(COUNT + joint, arrival)
        bones = self._pose.bones
        bones.pinned[joint] = True
        bones.pinned_positions[joint], bones.pinned_rotations[joint] = pose
        return True

    def _on_bone(self, address: str, serial: str) -> int | None:
        if serial in self._trackers:
            return self._trackers[serial]
        if address == "/VMC/Ext/Hmd/Pos":
            return BONES["Head"]
        return bone_of_tracker(serial)

    def _take_time(self, message: Message, arrival: float) -> bool:
        if not message.begins("f"):
            return False
        time = float(message.arguments[0])  # type: ignore[arg-type]  # a number, by its tag
        if not math.isfinite(time):
            return False
        self._mark()
        if self._time - time > STEP_BACK:
            self._restart()
        if time != self._time:
            self._time, self._time_came, self._time_used = time, arrival, False
        return True

    def _status(self, message: Message, arrival: float) -> bool:
        arguments = message.arguments
        if not message.begins("i"):
            return False
        self._mark()
        self._valid = arguments[0] != 0
        self._tracking = not message.begins("iiii") or arguments[3] != 0
        return True

    def _blend(self, message: Message, arrival: float) -> bool:
        if not message.begins("sf"):
            return False
        name, value = message.arguments[:2]
        weight = blend_weight(name, value)
        full = len(self._weights) >= MOST_BLENDS and name not in self._weights
        if full or weight is None:
            return False
        self._weights[str(name)] = weight
        return True

    def _apply(self, message: Message, arrival: float) -> bool:
        held = {**self.expressions, **self._weights}
        self.expressions = held if len(held) <= MOST_BLENDS else self._weights
        self._weights = {}
        return True

    # Frames.

    def _mark(self) -> None:
        """A time or status ends the frame: with this datagram if it has parts, else at once."""
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
        """Discard the old pose after a restart of the sender, except the parts received since."""
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
        """End the frame being assembled, and emit it unless it is a repetition."""
        assembly = self._assembly
        arrival = assembly.newest
        self._closing = self._rooted = False
        if self._repeated(arrival):
            assembly.discard()
            self.refused += 1
        else:
            assembly.end()
            device = self._time
            if self._time_used:  # times are sent less often than bones
                device += arrival - self._time_came
            if self._valid:
                self._emit(device, arrival)
        self._pose.bones.fresh[:] = False

    def _emit(self, device: float, arrival: float) -> None:
        """Add the frame at `device` [s] on the sender's clock to the result."""
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
                blends=self.expressions or None,
            )
        )

    def _repeated(self, arrival: float) -> bool:
        """Whether the frame duplicates the last one: the same pose and time, within the gap."""
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
