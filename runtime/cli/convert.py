"""`bunraku convert`: a recording of any kind becomes a file of another."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from devices.errors import InputError
from replay.bvh.export import write_bvh_recording
from replay.formats import recognise
from replay.joint_table import write_joint_table
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file


@dataclass(frozen=True, slots=True)
class _Wish:
    """How a file is to be written: what the format leaves open."""

    unit: str
    rate: float | None
    facts: dict[str, str]


def convert(options: argparse.Namespace) -> int:
    """Read a recording, write it again, and say what was guessed and what was lost.

    Raises:
        InputError: the recording cannot be read, the file cannot be written, is there already, or
            cannot hold what is asked for.
    """
    suffix = check_suffix(options.out, tuple(_WRITERS))
    _check_options(options, suffix)
    kind = recognise(options.recording)
    recording = kind.read(options.recording)
    if options.performer is not None:
        recording = recording.of(options.performer)
    files = _files(options.out, recording)
    for path in files:
        _check_free(path, options.recording, options.force)
    facts = {"converted_from": f"{options.recording.name} ({kind.name})"}
    if recording.notes:
        facts["notes"] = "; ".join(recording.notes)
    wish = _Wish(options.unit or "cm", options.rate, {**recording.source, **facts})
    for path, part in files.items():
        print(f"{path}: {_WRITERS[suffix](path, part, wish)}")
    print("".join(f"note        {note}\n" for note in recording.notes), end="")
    return 0


def _check_options(options: argparse.Namespace, suffix: str) -> None:
    for name, meaning in (("unit", "lengths are metres there"), ("rate", "it keeps every time")):
        if getattr(options, name) is not None and suffix != ".bvh":
            raise InputError(
                f"--{name} says nothing about a {suffix} file: {meaning}; leave it out"
            )


def _files(out: Path, recording: Recording) -> dict[Path, Recording]:
    """What goes into which file: BVH knows one performer, so each of several has a file."""
    performers = np.unique(recording.performers).tolist()
    if out.suffix.lower() != ".bvh" or len(performers) == 1:
        return {out: recording}
    return {
        out.with_name(f"{out.stem}-{performer}{out.suffix}"): recording.of(performer)
        for performer in performers
    }


def _check_free(path: Path, source: Path, force: bool) -> None:
    check_writable(path)
    if path.exists() and path.samefile(source):
        raise InputError(f"cannot write {path}: it is the recording itself; name another file")
    if path.is_file() and path.stat().st_size and not force:
        raise InputError(
            f"{path} is there already; name another file, or give --force to replace it"
        )


def _write_mcap(path: Path, recording: Recording, wish: _Wish) -> str:
    with whole_file(path) as partial:
        try:
            with McapWriter(partial, recording.skeleton, source=wish.facts) as writer:
                for index in range(len(recording)):
                    writer.write(recording.frame(index))
        except InputError as error:  # which knows only the name that it was given
            raise InputError(str(error).replace(str(partial), str(path))) from error
    return f"{len(recording)} frames in {recording.seconds:.3f} s"


def _write_table(path: Path, recording: Recording, wish: _Wish) -> str:
    del wish
    with whole_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        write_joint_table(file, recording)
    return f"{len(recording)} frames in {recording.seconds:.3f} s"


def _write_bvh(path: Path, recording: Recording, wish: _Wish) -> str:
    with whole_file(path) as partial, partial.open("w", encoding="utf-8") as file:
        made = write_bvh_recording(file, recording, unit=wish.unit, rate=wish.rate)
    median, nearly_all, most = (100 * stray for stray in made.strays)
    guesses = f", {100 * made.filled:.1f} % of the joints guessed" if made.filled else ""
    return (
        f"{made.frames} frames, {1 / made.step:.2f} a second, in {wish.unit}{guesses}; joints "
        f"{median:.2f} cm from the recording (median), {nearly_all:.2f} cm (99 %), "
        f"{most:.2f} cm at most"
    )


_WRITERS: dict[str, Callable[[Path, Recording, _Wish], str]] = {
    ".mcap": _write_mcap,
    ".bvh": _write_bvh,
    ".csv": _write_table,
}
