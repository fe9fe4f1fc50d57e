"""Which reader opens which recording: known by its content, not only by its name."""

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
    """One kind of recorded file.

    Attributes:
        name: what `bunraku info` calls it.
        recognises: whether a file is of this kind, from its path and its first `HEAD_BYTES` bytes.
        read: the whole file as a `Recording`; raises InputError naming the file and what is wrong.
    """

    name: str
    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path], Recording]


def formats() -> tuple[RecordingFormat, ...]:
    """Every kind of recording that can be opened, the most certain to recognise first."""
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
    """The format of the file at `path`.

    Raises:
        InputError: there is no such file, it cannot be read, or no reader knows it.
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
    raise InputError(f"{path} is not a recording that can be read; known kinds: {known}")


def read_recording(path: Path) -> Recording:
    """The recording in the file at `path`, of whatever kind.

    Raises:
        InputError: see `recognise` and the readers.
    """
    return recognise(path).read(path)
