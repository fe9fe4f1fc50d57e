"""Recognise the format of a recording by its content, and read it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from devices.errors import InputError
from replay.bvh.reader import read_bvh, recognises_bvh
from replay.joint_table import read_joint_table, recognises_joint_table
from replay.kinect.azure_csv import read_azure_csv, recognises_azure_csv
from replay.kinect.laban import read_laban, recognises_laban
from replay.kinect.msr import read_msr, recognises_msr
from replay.kinect.ntu import read_ntu, recognises_ntu
from replay.kinect.ut import read_ut, recognises_ut
from replay.leap.reader import read_leap, recognises_leap
from replay.mcap.reader import read_mcap, recognises_mcap
from replay.mediapipe.reader import read_mediapipe, recognises_mediapipe
from replay.recording import Recording

HEAD_BYTES = 4096


@dataclass(frozen=True, slots=True)
class RecordingFormat:
    """A file format of recordings.

    Attributes:
        name: its name in `bunraku info`.
        recognises: whether a file has this format, from its path and first `HEAD_BYTES` bytes.
        read: reads the file; raises InputError that names the file and the fault.
    """

    name: str
    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path], Recording]


def formats() -> tuple[RecordingFormat, ...]:
    """Return every readable format, the most certain to recognise first."""
    return (
        RecordingFormat("Bunraku recording (MCAP)", recognises_mcap, read_mcap),
        RecordingFormat("Bunraku table (CSV)", recognises_joint_table, read_joint_table),
        RecordingFormat("Leap Motion messages", recognises_leap, read_leap),
        RecordingFormat("MediaPipe landmarks", recognises_mediapipe, read_mediapipe),
        RecordingFormat("Azure Kinect joints (CSV)", recognises_azure_csv, read_azure_csv),
        RecordingFormat("Kinect v2, Labanotation Suite (CSV)", recognises_laban, read_laban),
        RecordingFormat("Kinect v2, NTU RGB+D (.skeleton)", recognises_ntu, read_ntu),
        RecordingFormat("Kinect v1, UTKinect-Action3D", recognises_ut, read_ut),
        RecordingFormat("Kinect v1, MSR Action3D", recognises_msr, read_msr),
        RecordingFormat("BVH", recognises_bvh, read_bvh),
    )


def recognise(path: Path) -> RecordingFormat:
    """Return the format of the file at `path`.

    Raises:
        InputError: the file does not exist, cannot be read, or has an unknown format.
    """
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if not head:
        raise InputError(f"{path} is empty; record or copy it again")
    for candidate in formats():
        if candidate.recognises(path, head):
            return candidate
    known = ", ".join(candidate.name for candidate in formats())
    raise InputError(f"{path} is not a recording that can be read; known formats: {known}")


def read_recording(path: Path) -> Recording:
    """Read the recording in the file at `path`, of any known format.

    Raises:
        InputError: see `recognise` and the readers.
    """
    return recognise(path).read(path)
