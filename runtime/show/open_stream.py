"""Opens a source of motion: a device by its address, or a recording by its path."""

from __future__ import annotations

from pathlib import Path

import devices.stream
from devices.errors import InputError
from devices.stream import SkeletonStream
from replay.formats import read_recording
from replay.player import EveryFrame, Player, RealTime
from replay.recording import Recording
from replay.stated import UNSTATED, Stated


def open_stream(
    source: str | Path,
    *,
    every_frame: bool = False,
    speed: float = 1.0,
    loop: bool = False,
    stated: Stated = UNSTATED,
) -> SkeletonStream:
    """Open a source of motion.

    Args:
        source: an address such as ``sim://wave`` or ``vmc://127.0.0.1:39539``, that is, a text with
            ``://`` in it; anything else is the path of a recording, in any format that is read.
        every_frame: for a recording: each poll gives exactly the next frame, whatever the clock
            says; without it the recorded timing counts.
        speed: for a recording with its timing: how many times as fast as it was recorded.
        loop: for a recording: start again after the last frame.
        stated: for a recording: what its file leaves open.

    Raises:
        InputError: there is no such device or file, it cannot be opened, or an option for
            recordings is given for a device.
    """
    if isinstance(source, Path) or "://" not in source:
        recording = read_recording(Path(source), stated)
        return play(recording, every_frame=every_frame, speed=speed, loop=loop)
    if every_frame or loop or speed != 1.0 or stated != UNSTATED:
        raise InputError(
            f"cannot open {source} with every_frame, speed, loop or stated: they are for recordings"
        )
    return devices.stream.open_stream(source)


def play(
    recording: Recording, *, every_frame: bool = False, speed: float = 1.0, loop: bool = False
) -> Player:
    """The stream of a recording in memory, with the options of `open_stream`."""
    return Player(recording, EveryFrame() if every_frame else RealTime(speed), loop=loop)
