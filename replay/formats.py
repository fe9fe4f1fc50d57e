"""Recognise the format of a recording by its content, and read it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from devices.errors import ContentError, InputError
from replay.bounds import check_recordable, plausible
from replay.bvh.reader import read_bvh, recognises_bvh
from replay.foreign import conversion_hint
from replay.gltf.reader import read_gltf_animation, recognises_gltf
from replay.joint_table import read_joint_table, recognises_joint_table
from replay.kinect.azure_csv import read_azure_csv, recognises_azure_csv
from replay.kinect.azure_json import read_azure_json, recognises_azure_json
from replay.kinect.joint_columns import read_joint_columns, recognises_joint_columns
from replay.kinect.laban import read_laban, recognises_laban
from replay.kinect.msr import read_msr, recognises_msr
from replay.kinect.ntu import read_ntu, recognises_ntu
from replay.kinect.ut import read_ut, recognises_ut
from replay.leap.reader import read_leap, recognises_leap
from replay.markers.c3d import read_c3d, recognises_c3d
from replay.markers.trc import read_trc, recognises_trc
from replay.mcap.reader import read_mcap, recognises_mcap
from replay.mediapipe.reader import read_mediapipe, recognises_mediapipe
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from replay.studio.amc import read_amc, recognises_amc
from replay.studio.mvnx import read_mvnx, recognises_mvnx
from replay.studio.openpose import read_openpose, recognises_openpose
from replay.studio.optitrack import read_optitrack, recognises_optitrack
from replay.studio.smpl import read_smpl, recognises_smpl
from replay.text_file import decoded, without_mark

HEAD_BYTES = 4096
JSON_HEAD_BYTES = 1 << 20
"""JSON may begin with anything: with the names of 478 points of a face, with a list of labels."""

_OPENING = tuple("{[")
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True, slots=True)
class RecordingFormat:
    """A file format of recordings.

    Attributes:
        name: its name in `bunraku info`.
        recognises: whether a file has this format, from its path and first bytes, in UTF-8 where
            it is text.
        reader: reads the file, and takes what is stated of its unit and axes; raises InputError
            that names the file and the fault, or ContentError that names the fault.
    """

    name: str
    recognises: Callable[[Path, bytes], bool]
    reader: Callable[[Path, Stated], Recording]

    @np.errstate(all="ignore")  # numbers of a damaged file
    def read(self, path: Path, stated: Stated = UNSTATED) -> Recording:
        """Read the file at `path`; what is stated of it comes before what is guessed.

        Raises:
            InputError: it is not a file, is damaged, or leaves nothing open that is stated.
        """
        if not path.is_dir():
            check_recordable(path)
        if stated.animation is not None and self.reader is not read_gltf_animation:
            raise InputError(
                f"{path}: --animation-input chooses among the animations of a glTF file, and this "
                "is none; leave it out"
            )
        try:
            recording = self.reader(path, stated)
        except ContentError as error:
            raise InputError(f"{path}: {error}") from None
        try:
            return stated.applied(plausible(recording))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


def _certain(read: Callable[[Path], Recording]) -> Callable[[Path, Stated], Recording]:
    """The reader of a format that says itself which unit and axes it has."""

    def reader(path: Path, stated: Stated) -> Recording:
        for option, value in (("--unit-input", stated.unit), ("--up-input", stated.up)):
            if value is not None:
                raise InputError(
                    f"{path}: {option} says what its format says already; leave it out"
                )
        return read(path)

    return reader


def formats() -> tuple[RecordingFormat, ...]:
    """Return every readable format, the most certain to recognise first."""
    return (
        RecordingFormat("Bunraku recording (MCAP)", recognises_mcap, _certain(read_mcap)),
        RecordingFormat("glTF animation (GLB, VRMA)", recognises_gltf, read_gltf_animation),
        RecordingFormat("Bunraku table (CSV)", recognises_joint_table, _certain(read_joint_table)),
        RecordingFormat("Leap Motion messages", recognises_leap, _certain(read_leap)),
        RecordingFormat(
            "Azure Kinect, offline processor (JSON)",
            recognises_azure_json,
            _certain(read_azure_json),
        ),
        RecordingFormat("MediaPipe landmarks", recognises_mediapipe, read_mediapipe),
        RecordingFormat(
            "Azure Kinect joints (CSV)", recognises_azure_csv, _certain(read_azure_csv)
        ),
        RecordingFormat(
            "Kinect table with joint names (CSV)",
            recognises_joint_columns,
            _certain(read_joint_columns),
        ),
        RecordingFormat(
            "Kinect v2, Labanotation Suite (CSV)", recognises_laban, _certain(read_laban)
        ),
        RecordingFormat("Kinect v2, NTU RGB+D (.skeleton)", recognises_ntu, _certain(read_ntu)),
        RecordingFormat("Kinect v1, UTKinect-Action3D", recognises_ut, _certain(read_ut)),
        RecordingFormat("Kinect v1, MSR Action3D", recognises_msr, _certain(read_msr)),
        RecordingFormat("SMPL motion, AMASS (.npz)", recognises_smpl, read_smpl),
        RecordingFormat("markers, C3D", recognises_c3d, read_c3d),
        RecordingFormat("markers, TRC", recognises_trc, read_trc),
        RecordingFormat("OptiTrack table (CSV)", recognises_optitrack, read_optitrack),
        RecordingFormat("Acclaim ASF/AMC", recognises_amc, read_amc),
        RecordingFormat("Xsens MVNX", recognises_mvnx, read_mvnx),
        RecordingFormat("OpenPose key points", recognises_openpose, read_openpose),
        RecordingFormat("BVH", recognises_bvh, read_bvh),
    )


def recognise(path: Path) -> RecordingFormat:
    """Return the format of the file at `path`.

    Raises:
        InputError: the file does not exist, cannot be read, or has an unknown format.
    """
    if path.is_dir() and recognises_openpose(path, b""):
        return next(kind for kind in formats() if kind.recognises is recognises_openpose)
    check_recordable(path)
    try:
        with path.open("rb") as file:
            head = _as_utf_8(file.read(HEAD_BYTES))
            if head.lstrip()[:1].decode("latin-1") in _OPENING:
                file.seek(0)
                head = _as_utf_8(file.read(JSON_HEAD_BYTES))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except ValueError:
        raise InputError(f"cannot read {str(path)!r}: no file can have this name") from None
    if not head:
        raise InputError(f"{path} is empty; record or copy it again")
    for candidate in formats():
        if candidate.recognises(path, head):
            return candidate
    if (hint := conversion_hint(path, head)) is not None:
        raise InputError(f"{path}: {hint}")
    known = ", ".join(candidate.name for candidate in formats())
    raise InputError(f"{path} is not a recording that can be read; known formats: {known}")


def _as_utf_8(head: bytes) -> bytes:
    """The first bytes of a file in UTF-8, without a mark, if they are text, else as they are."""
    if b"\0\0" in (head[:4:2], head[1:4:2]):  # UTF-16 without a mark
        return decoded(head[: len(head) & -2]).encode(errors="replace")
    return without_mark(head[: len(head) & -2] if head[:2] in _UTF_16 else head)


def read_recording(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the recording in the file at `path`, of any known format.

    Raises:
        InputError: see `recognise` and the readers.
    """
    return recognise(path).read(path, stated)
