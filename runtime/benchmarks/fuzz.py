"""Benchmark: damaged inputs of every reader and decoder; each is read or refused in one line.

A fault is any other exception, a warning, output to the terminal, a process, a written file, ten
seconds or two gigabytes. An input depends on the seed, its reader and its number only, so the same
command finds the same faults. Inputs with faults are kept.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import process_time

from devices.errors import InputError
from runtime.benchmarks.fuzzing.damage import damaged
from runtime.benchmarks.fuzzing.subjects import Subject, subjects
from runtime.benchmarks.fuzzing.watch import Watch

INPUTS = 200_000
PACKETS_A_FILE = 4
MOST_FAULTS = 10
"""Of one reader or decoder; then it is left."""


def run(
    *,
    inputs: int = INPUTS,
    seed: int = 0,
    recording: Sequence[Path] = (),
    character: Sequence[Path] = (),
) -> dict[str, object]:
    """Damage `inputs` inputs of all readers and decoders; print and return the counts.

    Args:
        inputs: how many.
        seed: of all damage.
        recording, character: further valid files to damage.

    Raises:
        InputError: there were faults; the message names the folder with the inputs.
    """
    counts: dict[str, int] = {}
    faults: list[str] = []
    began = process_time()
    with tempfile.TemporaryDirectory() as folder:
        watch = Watch(Path(folder) / "unpacked")
        every = subjects(Path(folder), recording, [Path(name) for name in character])
        with watch.quiet():
            for subject in every:
                _read_samples(subject)
            for subject, count in zip(every, _shares(every, inputs), strict=True):
                faults += _fuzz(watch, subject, count, seed)
                counts[subject.name] = count
    seconds = process_time() - began
    print(f"fuzz: {sum(counts.values())} inputs of {len(counts)} readers and decoders, seed {seed}")
    print(f"{seconds:.1f} s of processor time, {len(faults)} faults")
    for fault in faults:
        print(fault)
    if faults:
        raise InputError(f"{len(faults)} faults; the inputs are in {Path.cwd()} as fuzz-*")
    return {"inputs": counts, "seed": seed, "seconds": seconds}


def _shares(every: Sequence[Subject], inputs: int) -> list[int]:
    """How many inputs each reader and decoder gets: packets are read fast, files slowly."""
    weights = [PACKETS_A_FILE if subject.path is None else 1 for subject in every]
    whole = sum(weights)
    ends = [sum(weights[: place + 1]) * inputs // whole for place in range(len(weights))]
    return [end - start for start, end in zip([0, *ends], ends, strict=False)]


def _read_samples(subject: Subject) -> None:
    """Read what is not damaged: what is imported at first use is no fault of an input.

    Raises:
        ValueError: a sample is refused; its damage would prove nothing.
    """
    for sample in subject.samples:
        _placed(subject, sample)
        try:
            subject.read(sample)
        except InputError as error:
            raise ValueError(f"Expected a valid sample of {subject.name}: {error}") from error


def _fuzz(watch: Watch, subject: Subject, count: int, seed: int) -> list[str]:
    found: list[str] = []
    for number in range(count):
        chance = random.Random(f"{seed} {subject.name} {number}")
        content = damaged(chance, subject.samples)
        _placed(subject, content)

        def read(content: bytes = content) -> None:
            subject.read(content)

        fault = watch.fault(read)
        if fault:
            kept = Path(f"fuzz-{seed}-{number}-{subject.name.replace(' ', '-')}")
            kept.write_bytes(content)
            found.append(f"{subject.name}, input {number}: {fault}")
        if len(found) == MOST_FAULTS:
            break
    return found


def _placed(subject: Subject, content: bytes) -> None:
    if subject.path is not None:
        subject.path.write_bytes(content)
