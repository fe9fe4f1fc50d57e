"""Converting a recording of any kind to MCAP, BVH or a table, for `bunraku convert`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from devices.errors import InputError
from replay.bvh.export import write_bvh_recording
from replay.formats import recognise
from replay.joint_table import write_joint_table
from replay.mcap.writer import McapWriter
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from runtime.output.files.whole_file import check_suffix, check_writable, whole_file


@dataclass(frozen=True, slots=True)
class Conversion:
    """What to convert, and how.

    Attributes:
        recording: the file to read.
        out: the file to write, by its suffix.
        performer: the number of the only performer to write, or None for all.
        unit: of a BVH file; centimetres if None.
        rate: frames per second of a BVH file; the recording's if None.
        force: replace files that exist.
        stated: what the recording's file leaves open.
    """

    recording: Path
    out: Path
    performer: int | None = None
    unit: str | None = None
    rate: float | None = None
    force: bool = False
    stated: Stated = UNSTATED


@dataclass(frozen=True, slots=True)
class _FileOptions:
    """What the formats leave open: BVH unit and rate, and facts for the head of an MCAP file."""

    unit: str
    rate: float | None
    facts: dict[str, str]


def convert(options: Conversion) -> Iterator[str]:
    """Read a recording and write it again.

    Yields:
        A line about each file and about each guess.

    Raises:
        InputError: the recording cannot be read, the file cannot be written, is there already, or
            cannot hold what is asked for.
    """
    suffix = check_suffix(options.out, tuple(_WRITERS))
    _check_options(options, suffix)
    kind = recognise(options.recording)
    recording = kind.read(options.recording, options.stated)
    if options.performer is not None:
        recording = recording.of(options.performer)
    files = _files(options.out, recording)
    for path in files:
        _check_free(path, options.recording, options.force)
    facts = {"converted_from": f"{options.recording.name} ({kind.name})"}
    if recording.notes:
        facts["notes"] = "; ".join(recording.notes)
    own = _FileOptions(options.unit or "cm", options.rate, {**recording.source, **facts})
    for path, part in files.items():
        yield f"{path}: {_WRITERS[suffix](path, part, own)}"
    yield from (f"note        {note}" for note in recording.notes)


def _check_options(options: Conversion, suffix: str) -> None:
    for name, meaning in (("unit", "lengths are metres there"), ("rate", "it keeps every time")):
        if getattr(options, name) is not None and suffix != ".bvh":
            raise InputError(
                f"--{name} says nothing about a {suffix} file: {meaning}; leave it out"
            )


def _files(out: Path, recording: Recording) -> dict[Path, Recording]:
    """The recording of each file: a BVH file holds one performer, so each of several has one."""
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


def _write_mcap(path: Path, recording: Recording, options: _FileOptions) -> str:
    with whole_file(path) as partial:
        try:
            with McapWriter(partial, recording.skeleton, source=options.facts) as writer:
                for index in range(len(recording)):
                    writer.write(recording.frame(index))
        except InputError as error:  # it names the temporary file
            raise InputError(str(error).replace(str(partial), str(path))) from error
    return f"{len(recording)} frames in {recording.seconds:.3f} s"


def _write_table(path: Path, recording: Recording, options: _FileOptions) -> str:
    del options
    with whole_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        write_joint_table(file, recording)
    return f"{len(recording)} frames in {recording.seconds:.3f} s"


def _write_bvh(path: Path, recording: Recording, options: _FileOptions) -> str:
    with whole_file(path) as partial, partial.open("w", encoding="utf-8") as file:
        made = write_bvh_recording(file, recording, unit=options.unit, rate=options.rate)
    median, nearly_all, most = (100 * stray for stray in made.strays)
    guesses = f", {100 * made.filled:.1f} % of the joints guessed" if made.filled else ""
    return (
        f"{made.frames} frames, {1 / made.step:.2f} a second, in {options.unit}{guesses}; joints "
        f"{median:.2f} cm from the recording (median), {nearly_all:.2f} cm (99 %), "
        f"{most:.2f} cm at most"
    )


_WRITERS: dict[str, Callable[[Path, Recording, _FileOptions], str]] = {
    ".mcap": _write_mcap,
    ".bvh": _write_bvh,
    ".csv": _write_table,
}
