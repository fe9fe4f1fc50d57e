"""Performing a show for the command line, with its progress: for `demo`, `replay` and `live`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path

from devices.stream import SkeletonStream
from replay.player import Player
from runtime.characters.open_character import load_character
from runtime.cli.show_options import show_settings
from runtime.cli.warm import warm_up
from runtime.show.collector_pauses import collector_paused
from runtime.show.outputs import check_outputs
from runtime.show.pacing import AtOnce
from runtime.show.progress import Progress
from runtime.show.show import Show


def perform(
    options: argparse.Namespace,
    open_source: Callable[[], SkeletonStream],
    *,
    origin: str,
    read: Sequence[tuple[str, Path]] = (),
) -> int:
    """Perform the show that the options ask for; the exit code.

    Args:
        options: of the command line; nothing behind this sees them.
        open_source: opens the stream, once all files are known to be possible.
        origin: the address or name of the stream.
        read: files that are read and must not be written, each with the name of its option.

    Raises:
        InputError: anything that a user can put right.
    """
    settings = show_settings(options, origin)
    names = [Path(name).stem for name in options.character]
    check_outputs(
        settings, names, [*read, *(("--character", Path(name)) for name in options.character)]
    )
    warm_up()
    with collector_paused():
        source = open_source()
    with source as stream:
        with collector_paused():
            characters = [load_character(name) for name in options.character]
        with Show(stream, characters, settings, pace=AtOnce() if options.fast else None) as show:
            _run(show, stream)
    return 0


def _run(show: Show, stream: SkeletonStream) -> None:
    total = len(stream.recording) if isinstance(stream, Player) and not stream.loop else None
    with Progress("performing", total) as progress:
        show.run(lambda: progress.advance(said=_milliseconds(show.latency)))


def _milliseconds(seconds: float) -> str:
    """For the progress bar; empty where the latency is unknown."""
    return f"{1e3 * seconds:.1f} ms" if math.isfinite(seconds) else ""
