"""Rokoko Studio's live stream: ``rokoko://127.0.0.1:14043``, JSON by UDP, a scene a datagram.

Versions 2 and 3 of its format, as plain JSON or as an LZ4 frame. Every bone has an absolute
position [m] and rotation in Unity's space; rotations keep the local axes of Rokoko's own rig. The
scene's time starts again when a clip loops. Faces, props and trackers are passed over.

Source: Rokoko Studio's custom streaming documentation, and how its plug-ins read it.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import SplitResult

import lz4.frame  # type: ignore[import-untyped]  # lz4 has no types
import numpy as np
from numpy.typing import NDArray

from devices.address import host_and_port, options_of
from devices.bodies.unity_space import across_unity, turn_across_unity
from devices.skeleton import SkeletonFrame
from devices.suits.rokoko_bones import SKELETON
from devices.transport.clock_map import STEP_BACK, ClockMap
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

Array = NDArray[np.float64]

PORT = 14043
MOST_BYTES = 1 << 20  # of a scene's JSON; five actors with hands and faces have 150 kB
MOST_ACTORS = 16
LONGEST_NAME = 256
FARTHEST = 1000.0  # [m] or a position is not believed
AGAIN = 0.004  # [s] within which the same datagram is the network's doing, not the sender's
MOST_OVERTAKEN = 2  # scenes in a row
_MAGIC = b"\x04\x22\x4d\x18"


class RokokoDecoder:
    """Frames of every actor of one Rokoko Studio; an actor is known by the name.

    Attributes:
        refused: datagrams, actors and bones that were malformed, late, repeated or beyond belief.
    """

    skeleton = SKELETON

    def __init__(self) -> None:
        self.refused = 0
        self._clock = ClockMap()
        self._numbers: OrderedDict[str, int] = OrderedDict()  # who was seen last comes last
        self._stamp = math.nan
        self._came = -math.inf
        self._behind = 0  # scenes in a row that were overtaken
        self._last = b""

    @np.errstate(over="ignore", invalid="ignore")  # whatever a damaged packet holds
    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """A frame of each actor in a datagram that came at `arrival` [s]."""
        scene = _scene(data)
        if scene is None or self._repeated(data, arrival):
            self.refused += 1
            return ()
        stamp = _number(scene.get("timestamp"))
        if self._overtaken(stamp, arrival):
            self.refused += 1
            return ()
        # A clock that stands (a clip that is paused, a sender without one) tells nothing.
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
        """Whether a newer scene came before, just now; several in a row are a clip that loops."""
        late = 0.0 < self._stamp - stamp <= STEP_BACK and arrival - self._came < STEP_BACK
        self._behind = self._behind + 1 if late else 0
        return 0 < self._behind <= MOST_OVERTAKEN

    def _frame(self, actor: Any, time: float, arrival: float) -> SkeletonFrame | None:
        """An actor's frame; None where there is no body, or no name to know it by."""
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
        )

    def _bones(self, body: Mapping[str, Any]) -> tuple[Array, Array]:
        """Positions (J, 3) [m] and rotations (J, 4) as sent; NaN where there is none."""
        table = np.full((len(SKELETON.names), 7), np.nan)
        for joint, name in enumerate(SKELETON.names):
            bone = body.get(name)
            if bone is not None:
                table[joint] = _pose(bone)
        positions, rotations = table[:, :3], table[:, 3:]
        near = (np.abs(positions) < FARTHEST).all(axis=1)  # NaN is not
        positions[~near] = np.nan
        self.refused += sum(SKELETON.names[joint] in body for joint in np.flatnonzero(~near))
        length = np.linalg.norm(rotations, axis=1)
        turned = near & (length > 0.5) & (length < 2.0)
        rotations[turned] /= length[turned, None]
        rotations[~turned] = np.nan
        return positions, rotations

    def _number_of(self, name: str) -> int:
        """The actor's number; of a new one the lowest that is free."""
        if name not in self._numbers:
            if len(self._numbers) >= MOST_ACTORS:
                self._numbers.popitem(last=False)
            taken = set(self._numbers.values())
            free = next(number for number in range(MOST_ACTORS) if number not in taken)
            self._numbers[name] = free
        self._numbers.move_to_end(name)
        return self._numbers[name]


def _scene(data: bytes) -> dict[str, Any] | None:
    """What has the actors: the scene of version 3, the whole message of version 2; None if nothing.

    A message of version 2.5 calls itself 3, so what is there decides and not the number.
    """
    text = _unpacked(data)
    if text is None:
        return None
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(message, dict):
        return None
    scene = message.get("scene", message)
    if not isinstance(scene, dict):
        return None
    actors = scene.get("actors")
    return scene if isinstance(actors, list) and len(actors) <= MOST_ACTORS else None


def _unpacked(data: bytes) -> bytes | None:
    """The JSON of a datagram, at most `MOST_BYTES`, whatever an LZ4 frame claims or grows to."""
    if not data.startswith(_MAGIC):
        return data if len(data) <= MOST_BYTES else None
    frame = lz4.frame.LZ4FrameDecompressor()
    try:
        text: bytes = frame.decompress(data, max_length=MOST_BYTES)
    except (RuntimeError, ValueError, MemoryError):
        return None
    return text if frame.eof and not frame.unused_data else None


def _pose(bone: Any) -> tuple[float, ...]:
    """Position and rotation of a bone; NaN where a number is missing or none."""
    parts = [bone.get(key) if isinstance(bone, dict) else None for key in ("position", "rotation")]
    position, rotation = (part if isinstance(part, dict) else {} for part in parts)
    return (
        *(_number(position.get(axis)) for axis in "xyz"),
        *(_number(rotation.get(axis)) for axis in "xyzw"),
    )


def _number(value: Any) -> float:
    """A number that JSON may have written as a whole one; NaN where it is none."""
    if type(value) is float:
        return value
    if type(value) is int and abs(value) < 1 << 53:
        return float(value)
    return math.nan


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``rokoko://HOST:PORT``.

    Raises:
        InputError: the port is taken, or an option is not known.
    """
    options_of(address)
    host, port = host_and_port(address, PORT)
    return LiveStream(UdpTransport(host, port, scheme=address.scheme), RokokoDecoder)
