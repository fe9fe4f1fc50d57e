"""Device ``rokoko://127.0.0.1:14043``: Rokoko Studio's live stream, JSON by UDP.

Each datagram is one scene in version 2 or 3 of the format, as plain JSON or as an LZ4 frame. Every
bone has an absolute position [m] and rotation in Unity's space; rotations keep the local axes of
Rokoko's own rig. The scene's time starts again when a clip loops. An actor's face in version 3, by
ARKit's 52 names, becomes blend shapes. Faces of version 2, props and trackers are ignored.

Source: Rokoko Studio's custom streaming documentation, and its plug-ins.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import SplitResult

import lz4.frame  # type: ignore[import-untyped]  # lz4 has no types
import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, options_of
from devices.blend_shapes import Blends, checked_blends
from devices.bodies.unity_space import across_unity, turn_across_unity
from devices.skeleton import SkeletonFrame
from devices.suits.rokoko_bones import SKELETON
from devices.transport.clock_map import STEP_BACK, ClockMap
from devices.transport.json_object import json_object
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

Array = NDArray[np.float64]

PORT = 14043
MOST_BYTES = 1 << 20  # of a scene's JSON; five actors with hands and faces take 150 kB
MOST_ACTORS = 16
LONGEST_NAME = 256
FARTHEST = 1000.0  # [m] of a plausible position
AGAIN = 0.004  # [s] within which an equal datagram is a duplicate made by the network
MOST_OVERTAKEN = 2  # late scenes in a row; more are a clip that loops
_MAGIC = b"\x04\x22\x4d\x18"


class RokokoDecoder:
    """Frames of every actor of one Rokoko Studio; an actor is identified by name.

    Attributes:
        refused: datagrams, actors and bones that were malformed, late, repeated or implausible.
    """

    skeleton = SKELETON

    def __init__(self) -> None:
        self.refused = 0
        self._clock = ClockMap()
        self._numbers: OrderedDict[str, int] = OrderedDict()  # the actor seen last comes last
        self._stamp = math.nan
        self._came = -math.inf
        self._behind = 0  # late scenes in a row
        self._last = b""

    @np.errstate(over="ignore", invalid="ignore")  # values of a damaged packet
    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return a frame of each actor in a datagram received at `arrival` [s]."""
        scene = _scene(data)
        if scene is None or self._repeated(data, arrival):
            self.refused += 1
            return ()
        stamp = _number(scene.get("timestamp"))
        if self._overtaken(stamp, arrival):
            self.refused += 1
            return ()
        # A constant clock (a paused clip, a sender without a clock) gives no time.
        time = self._clock.host_time(math.nan if stamp == self._stamp else stamp, arrival)
        self._stamp, self._came, self._last = stamp, arrival, data
        frames = []
        numbers: set[int] = set()
        for actor in scene["actors"]:
            frame = self._frame(actor, time, arrival)
            if frame is None or frame.performer in numbers:
                self.refused += 1
            else:
                numbers.add(frame.performer)
                frames.append(frame)
        return frames

    def _repeated(self, data: bytes, arrival: float) -> bool:
        return data == self._last and arrival - self._came < AGAIN

    def _overtaken(self, stamp: float, arrival: float) -> bool:
        """Whether a newer scene came just before; several late ones in a row are a looping clip."""
        late = 0.0 < self._stamp - stamp <= STEP_BACK and arrival - self._came < STEP_BACK
        self._behind = self._behind + 1 if late else 0
        return 0 < self._behind <= MOST_OVERTAKEN

    def _frame(self, actor: Any, time: float, arrival: float) -> SkeletonFrame | None:
        """An actor's frame; None without a body or a name."""
        if not isinstance(actor, dict):
            return None
        name, body = actor.get("name", actor.get("id")), actor.get("body", actor)
        if not isinstance(name, str) or len(name) > LONGEST_NAME or not isinstance(body, dict):
            return None
        positions, rotations = self._bones(body)
        seen = np.isfinite(positions[:, 0])
        if not seen.any():
            return None
        return SkeletonFrame(
            time=time,
            positions=across_unity(positions),
            rotations=turn_across_unity(rotations),
            confidence=seen * 1.0,
            performer=self._number_of(name),
            arrival=arrival,
            blends=_face(actor.get("face")),
        )

    def _bones(self, body: Mapping[str, Any]) -> tuple[Array, Array]:
        """Positions (J, 3) [m] and rotations (J, 4) as sent; NaN where missing."""
        table = np.full((len(SKELETON.names), 7), np.nan)
        for joint, name in enumerate(SKELETON.names):
            bone = body.get(name)
            if bone is not None:
                table[joint] = _pose(bone)
        positions, rotations = table[:, :3], table[:, 3:]
        near = (np.abs(positions) < FARTHEST).all(axis=1)  # False for NaN
        positions[~near] = np.nan
        self.refused += sum(SKELETON.names[joint] in body for joint in np.flatnonzero(~near))
        length = np.linalg.norm(rotations, axis=1)
        turned = near & (length > 0.5) & (length < 2.0)
        rotations[turned] /= length[turned, None]
        rotations[~turned] = np.nan
        return positions, rotations

    def _number_of(self, name: str) -> int:
        """The actor's number; a new actor gets the lowest free one."""
        if name not in self._numbers:
            if len(self._numbers) >= MOST_ACTORS:
                self._numbers.popitem(last=False)
            taken = set(self._numbers.values())
            free = next(number for number in range(MOST_ACTORS) if number not in taken)
            self._numbers[name] = free
        self._numbers.move_to_end(name)
        return self._numbers[name]


def _scene(data: bytes) -> dict[str, Any] | None:
    """The object with the actors: the scene in version 3, the whole message in version 2, or None.

    A message of version 2.5 states version 3, so the structure decides, not the number.
    """
    message = json_object(_unpacked(data) or b"", MOST_BYTES)
    scene = message.get("scene", message)
    if not isinstance(scene, dict):
        return None
    actors = scene.get("actors")
    return scene if isinstance(actors, list) and len(actors) <= MOST_ACTORS else None


def _unpacked(data: bytes) -> bytes | None:
    """The JSON of a datagram, at most `MOST_BYTES`, whatever size an LZ4 frame states."""
    if not data.startswith(_MAGIC):
        return data if len(data) <= MOST_BYTES else None
    frame = lz4.frame.LZ4FrameDecompressor()
    try:
        text: bytes = frame.decompress(data, max_length=MOST_BYTES)
    except (RuntimeError, ValueError, MemoryError):
        return None
    return text if frame.eof and not frame.unused_data else None


def _face(face: Any) -> Blends | None:
    """The weights in [0, 1] of an actor's blend shapes, which Rokoko sends as 0 to 100."""
    if not isinstance(face, dict):
        return None
    return checked_blends((name, _number(value) / 100.0) for name, value in face.items())


def _pose(bone: Any) -> tuple[float, ...]:
    """Position and rotation of a bone; NaN where a number is missing or invalid."""
    parts = [bone.get(key) if isinstance(bone, dict) else None for key in ("position", "rotation")]
    position, rotation = (part if isinstance(part, dict) else {} for part in parts)
    return (
        *(_number(position.get(axis)) for axis in "xyz"),
        *(_number(rotation.get(axis)) for axis in "xyzw"),
    )


def _number(value: Any) -> float:
    """A number, which JSON may have written as an integer; NaN for any other value."""
    if type(value) is float:
        return value
    if type(value) is int and abs(value) < 1 << 53:
        return float(value)
    return math.nan


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``rokoko://HOST:PORT``.

    Raises:
        InputError: the port is taken, or an option is unknown.
    """
    options_of(address)
    host, port = host_and_port(address, PORT)
    return LiveStream(UdpTransport(host, port, scheme=address.scheme), RokokoDecoder)
