"""Faces in recordings: they come back bit for bit, and damaged ones do no harm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
import pytest

from devices.blend_shapes import MOST_BLENDS
from devices.skeleton import Skeleton, SkeletonFrame
from replay.info import summary
from replay.mcap.frame_json import decode_frame, encode_frame
from replay.mcap.reader import read_mcap
from replay.player import EveryFrame, Player
from replay.recorder import Recorder

ARM = Skeleton(("shoulder", "hand"), np.array([-1, 0]), np.eye(3)[:2])


def frame(k: int, blends: dict[str, float] | None, performer: int = 0) -> SkeletonFrame:
    positions = np.random.default_rng(k).normal(size=(2, 3))
    return SkeletonFrame(
        k / 30, positions, None, np.ones(2), performer, arrival=k / 30, blends=blends
    )


def test_faces_are_recorded_and_replayed_bit_for_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    faces: list[dict[str, float] | None] = [None]
    faces += [{"喜び": float(rng.uniform()), "jawOpen": float(rng.uniform())} for _ in range(5)]
    faces += [dict(faces[-1] or {}), None]
    path = tmp_path / "faces.mcap"
    with Recorder(path, ARM, tell=pytest.fail) as recorder:
        for k, face in enumerate(faces):
            recorder.write(frame(k, face))
    recording = read_mcap(path)
    assert recording.blends == tuple(faces)
    assert recording.blends[5] is recording.blends[6], "a face that is held takes no room"
    player = Player(recording, EveryFrame())
    assert [player.poll()[0].blends for _ in faces] == faces
    (line,) = [line for line in summary(recording, path, "MCAP") if line.startswith("blends ")]
    assert "2 blend shapes in 75 % of frames, 2 of them move: jawOpen, 喜び" in line


def test_a_recording_without_faces_has_none(tmp_path: Path) -> None:
    path = tmp_path / "plain.mcap"
    with Recorder(path, ARM, tell=pytest.fail) as recorder:
        recorder.write(frame(0, None))
    recording = read_mcap(path)
    assert recording.blends is None
    assert recording.frame(0).blends is None
    assert not any(line.startswith("blends ") for line in summary(recording, path, "MCAP"))
    assert b"blends" not in encode_frame(frame(0, None))


def test_the_faces_of_one_performer_are_chosen_with_the_frames(tmp_path: Path) -> None:
    path = tmp_path / "two.mcap"
    with Recorder(path, ARM, tell=pytest.fail) as recorder:
        for k in range(6):
            recorder.write(frame(k, {"a": k / 10}, performer=k % 2))
    recording = read_mcap(path)
    assert recording.of(1).blends == ({"a": 0.1}, {"a": 0.3}, {"a": 0.5})
    with pytest.raises(ValueError, match="6 faces"):
        replace(recording, blends=())


@pytest.mark.parametrize(
    "blends",
    [3, "x", [], {}, {"a": None}, {"": 1.0}, {"a": "1"}, {"a": [1]}, {"x" * 1000: 0.5}],
)
def test_a_damaged_face_is_none_and_its_frame_is_read(blends: object) -> None:
    found = orjson.loads(encode_frame(frame(1, {"a": 0.5})))
    found["blends"] = blends
    read = decode_frame(orjson.dumps(found), 2)
    assert read.blends is None
    np.testing.assert_array_equal(read.positions, frame(1, None).positions)


def test_a_face_in_a_file_is_bounded() -> None:
    found = orjson.loads(encode_frame(frame(1, None)))
    found["blends"] = {f"shape {k}": 1e300 * k for k in range(5000)}
    blends = decode_frame(orjson.dumps(found), 2).blends
    assert blends is not None
    assert len(blends) == MOST_BLENDS
    assert set(blends.values()) == {0.0, 1.0}
