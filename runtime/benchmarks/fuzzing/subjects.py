"""What the fuzzer damages: each reader and decoder, with small valid inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from devices.bridge.messages import decode
from devices.errors import InputError
from devices.kinect import azure, v1, v2
from devices.kinect.bodies import KinectDecoder
from devices.leap.websocket_messages import LeapDecoder
from devices.mediapipe.landmark_messages import LandmarkDecoder
from devices.osc.nimate import NimateDecoder
from devices.osc.vmc_decoder import VmcDecoder
from devices.osc.vrchat import VrchatDecoder
from devices.skeleton import SkeletonFrame
from devices.suits.rokoko import RokokoDecoder
from devices.suits.xsens import XsensDecoder
from replay.builtin import builtin_recording
from replay.formats import read_recording
from runtime.benchmarks.fuzzing.file_samples import (
    MAPPING,
    MOTION,
    SKELETON,
    TEXTURED,
    character_samples,
    pictures,
    recording_samples,
)
from runtime.benchmarks.fuzzing.packet_samples import packet_samples
from runtime.benchmarks.fuzzing.session_samples import session_samples
from runtime.characters.builtin import builtin_character
from runtime.characters.formats.mesh_file import MESH_SUFFIXES, read_mesh_file
from runtime.characters.gltf.rig import read_gltf
from runtime.driving.mapping import read_mapping

_STEP = 1 / 250  # [s] between two packets


class Feeding(Protocol):
    """What takes packets."""

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frames that a packet, received at `arrival` [s], completes."""
        ...


@dataclass(frozen=True, slots=True)
class Subject:
    """A reader or decoder.

    Attributes:
        name: of its kind of input.
        samples: valid inputs.
        read: takes an input; it may raise InputError and nothing else.
        path: the file that holds the input when `read` is called; None for packets.
    """

    name: str
    samples: tuple[bytes, ...]
    read: Callable[[bytes], None]
    path: Path | None = None


def subjects(folder: Path, recordings: Sequence[Path], characters: Sequence[Path]) -> list[Subject]:
    """Every reader and decoder.

    Args:
        folder: an empty folder for the files that are read.
        recordings, characters: further valid files to damage.

    Raises:
        InputError: one of the files cannot be read.
    """
    motions = [*recording_samples(folder), *map(_content, recordings)]
    shapes = [*character_samples(), *map(_content, characters)]
    return [
        *(_of_file(folder / name, data, _recording) for name, data in motions),
        *_acclaim(folder),
        *(_of_file(folder / name, data, read) for name, data, read in session_samples(folder)),
        *(_of_file(folder / name, data, _character) for name, data in shapes),
        _of_file(folder / "mapping.json", MAPPING, _mapping),
        *(_picture(folder / f"textures-{kind}", data) for kind, data in pictures().items()),
        *(_of_packets(name, packets) for name, packets in packet_samples().items()),
    ]


def _content(path: Path) -> tuple[str, bytes]:
    try:
        return path.name, path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error


def _of_file(path: Path, sample: bytes, read: Callable[[Path], None]) -> Subject:
    return Subject(path.name, (sample,), lambda _: read(path), path)


def _acclaim(folder: Path) -> list[Subject]:
    """A motion beside its skeleton, and a skeleton beside its motion."""
    return [
        _half(folder / "motion", "a.amc", MOTION, SKELETON),
        _half(folder / "bones", "a.asf", SKELETON, MOTION),
    ]


def _half(folder: Path, name: str, sample: bytes, partner: bytes) -> Subject:
    folder.mkdir()
    motion = folder / "a.amc"
    for half in (motion, folder / "a.asf"):
        half.write_bytes(sample if half.name == name else partner)
    return Subject(name, (sample,), lambda _: _recording(motion), folder / name)


def _picture(folder: Path, sample: bytes) -> Subject:
    """A texture beside an OBJ; each kind of picture is called PNG, as strangers may do."""
    folder.mkdir()
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n", encoding="ascii")
    (folder / "m.obj").write_text(TEXTURED, encoding="ascii")

    def read(_: bytes) -> None:
        notes = read_mesh_file(folder / "m.obj").notes
        assert len(notes) <= 1, f"{len(notes)} notes"

    return Subject(folder.name, (sample,), read, folder / "t.png")


def _of_packets(name: str, packets: Sequence[bytes]) -> Subject:
    """A decoder; it lives as long as the fuzzer, as one of a long show."""
    decoder = DECODERS[name]()
    count = 0

    def read(data: bytes) -> None:
        nonlocal count
        count += 1
        for frame in decoder.feed(data, 100.0 + count * _STEP):
            seen = frame.confidence > 0.0
            assert np.isfinite(frame.positions[seen]).all(), "a joint that was seen has no place"

    return Subject(f"packets of {name}", tuple(packets), read)


class _Bridge:
    """The messages of a bridge, which need no state to be decoded."""

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        del arrival
        decode(data)
        return ()


DECODERS: dict[str, Callable[[], Feeding]] = {
    "vmc": VmcDecoder,
    "vrchat": VrchatDecoder,
    "nimate": NimateDecoder,
    "leap": LeapDecoder,
    "mediapipe": lambda: LandmarkDecoder(hands=True),
    "rokoko": RokokoDecoder,
    "xsens": XsensDecoder,
    "bridge": _Bridge,
    "Kinect v1": lambda: KinectDecoder(v1.SENSOR),
    "Kinect v2": lambda: KinectDecoder(v2.SENSOR),
    "Azure Kinect": lambda: KinectDecoder(azure.SENSOR),
}
"""The decoder of each protocol."""


def _mapping(path: Path) -> None:
    read_mapping(path, builtin_recording().skeleton, builtin_character("paper").skeleton)


def _recording(path: Path) -> None:
    recording = read_recording(path)
    seen = recording.confidence > 0.0
    assert np.isfinite(recording.positions[seen]).all(), "a joint that was seen has no place"
    assert (np.diff(recording.times) >= 0.0).all(), "times decrease"


def _character(path: Path) -> None:
    if path.suffix.lower() in MESH_SUFFIXES:
        vertices, notes = (mesh := read_mesh_file(path)).vertices, mesh.notes
    else:
        vertices, notes = (model := read_gltf(path)).file_vertices, model.notes
    assert np.isfinite(vertices).all(), "a vertex has no place"
    assert all("\n" not in note for note in notes), "a note has several lines"
