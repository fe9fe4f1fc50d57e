"""A small session for the fuzzer: its document, a performance, and its file."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.session.document import Actor, Clip, Mark, Session, Take
from runtime.session.files import codec
from runtime.session.files.archive import unpack
from runtime.session.files.folder import DOCUMENT
from runtime.session.files.performance_file import read_performance, save_performance
from runtime.session.performance import Performance
from runtime.session.setup import Pair, Setup, StruckMatch

Sample = tuple[str, bytes, Callable[[Path], None]]


def session_samples(folder: Path) -> list[Sample]:
    """The name and content of each file of a session, and what reads it.

    Args:
        folder: for files that are made and removed; one of it is left for what is unpacked.
    """
    performance = Performance(
        times=np.array([0.0, 0.25, 0.5], np.float32),
        nodes=np.array([0, 1]),
        turns=np.tile(np.array([0, 0, 0, 1], np.float32), (3, 2, 1)),
        shifts=np.full((3, 2, 3), 0.1, np.float32),
        placements=np.full((3, 5), 0.5, np.float32),
    )
    pair = Pair(("hip", "knee"), (0, 1))
    match = StruckMatch(
        ("hip", "knee"), ((0.0, 1.0, 0.0), (0.0, 0.5, 0.0)), 0.0, 1.0, pairs=(pair,)
    )
    actor = Actor(1, "squid", "squid", "auto", 2, Setup(match))
    take = Take(1, "take 1", 1, performance, "take-1.mcap", ("arm -> arm, absolute, 100 %",))
    clip = Clip(1, 1, 0.0, 0.0, performance.duration)
    session = Session((actor,), (take,), (clip,), (Mark(0.5, "here"),), (0.0, 1.0))
    document = json.dumps(codec.as_json(session)).encode()
    made = folder / "made.glb"
    save_performance(made, performance, Skeleton(("a", "b"), np.array([-1, 0]), np.eye(3)[:2]))
    moves = made.read_bytes()
    made.unlink()
    packed = folder / "made.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(DOCUMENT, document)
        file.writestr(f"performances/{performance.key}.glb", moves)
    whole = packed.read_bytes()
    packed.unlink()
    unpacked = folder / "unpacked"
    unpacked.mkdir()

    def read_document(path: Path) -> None:
        try:
            parsed = parse_json(path.read_bytes())
        except ValueError as error:
            raise InputError(str(error)) from None
        codec.performances_in(parsed)
        codec.from_json(codec.without_takes(parsed, {"none"}), lambda _: performance)

    return [
        ("session.json", document, read_document),
        ("performance.glb", moves, lambda path: _discard(read_performance(path))),
        ("session.bunraku", whole, lambda path: _discard(unpack(path, unpacked))),
    ]


def _discard(_: object) -> None:
    pass
