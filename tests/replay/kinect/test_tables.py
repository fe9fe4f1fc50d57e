"""Kinect tables that name their joints, and the offline processor's JSON, in every form."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from devices.kinect.joints import (
    AZURE_TO_WORLD,
    KINECT_AZURE,
    KINECT_TO_WORLD,
    KINECT_V1,
    KINECT_V2,
)
from devices.skeleton import Skeleton
from replay.formats import read_recording
from tests.replay.kinect.test_readers import LIFT, seen_by

RIGHT = KINECT_V2.index("HandRight")
POSES = seen_by(KINECT_V2, KINECT_TO_WORLD).round(6)
NAMES = KINECT_V2.names


def lines(*rows: Sequence[object], between: str = ",", end: str = "") -> str:
    return "".join(between.join(map(str, row)) + end + "\n" for row in rows)


def cells(pose: np.ndarray, comma: bool = False) -> list[str]:
    text = [f"{value:.6f}" for value in pose.ravel()]
    return [cell.replace(".", ",") for cell in text] if comma else text


def under(between: str, comma: bool = False) -> str:
    """Kinect-2-CSV: a line of names, a line of X, Y, Z, a sign after the last field."""
    names = [cell for name in NAMES for cell in (name, "", "")]
    poses = [cells(pose, comma) for pose in POSES]
    return lines(names, ["X", "Y", "Z"] * len(NAMES), *poses, between=between, end=between)


def with_orientations() -> str:
    head = "\t\t\t\t\t\t\t".join(NAMES) + "\n"
    fields = [f"Position.{axis}" for axis in "XYZ"] + [f"Orientation.{axis}" for axis in "XYZW"]
    rows = [[cell for place in pose for cell in (*cells(place), 0, 0, 0, 1)] for pose in POSES]
    return head + lines(fields * len(NAMES), *rows, between=";", end=";")


def one_a_joint(named: bool) -> str:
    head = "Timestamp, JointID, Position.X, Position.Y, Position.Z, Orientation.X, State"
    rows = [
        [frame * 33, name if named else number, *cells(place), 0, 2 - (number == RIGHT)]
        for frame, pose in enumerate(POSES)
        for number, (name, place) in enumerate(zip(NAMES, pose, strict=True))
    ]
    return head + "\n" + lines(*rows)


HEADER = [f"{name}_{axis}" for name in NAMES for axis in "XYZ"]
TABLES: dict[str, tuple[str, float]] = {
    "Kinect-2-CSV": (under(";"), 1 / 30),
    "Kinect-2-CSV, decimal commas": (under(";", comma=True), 1 / 30),
    "Kinect-2-CSV, commas": (under(","), 1 / 30),
    "Kinect-2-CSV, orientations": (with_orientations(), 1 / 30),
    "stamp and names": (
        lines(["TimeStamp", *HEADER], *([40 * n, *cells(p)] for n, p in enumerate(POSES))),
        0.04,
    ),
    "a stamp before each joint": (
        lines(
            ["TimeStamp", *HEADER],
            *([c for place in p for c in (40 * n, *cells(place))] for n, p in enumerate(POSES)),
        ),
        0.04,
    ),
    "names.X": (
        lines([f"{name}.{axis}" for name in NAMES for axis in "xyz"], *map(cells, POSES)),
        1 / 30,
    ),
    "a row a joint, numbers": (one_a_joint(named=False), 0.033),
    "a row a joint, names": (one_a_joint(named=True), 0.033),
}


def rises(recording_positions: np.ndarray, joint: int) -> float:
    return float(recording_positions[1, joint, 1] - recording_positions[0, joint, 1])


@pytest.mark.parametrize("kind", TABLES)
def test_tables_with_joint_names_hold_the_same(kind: str, tmp_path: Path) -> None:
    text, step = TABLES[kind]
    path = tmp_path / "body.csv"
    path.write_text(text)
    recording = read_recording(path)
    assert recording.skeleton.names == NAMES
    assert recording.times == pytest.approx([0, step])
    rest = KINECT_V2.rest_positions
    expected = rest - rest[:, 1].min() * np.array([0, 1, 0]) - rest[0] * [1, 0, 1]
    np.testing.assert_allclose(recording.positions[0], expected, atol=0.04)  # levelled
    assert rises(recording.positions, RIGHT) == pytest.approx(LIFT, abs=1e-3)
    assert recording.confidence[0, RIGHT] == (0.5 if "a row a joint" in kind else 1.0)


@pytest.mark.parametrize(
    ("skeleton", "to_world", "unit"),
    [(KINECT_V1, KINECT_TO_WORLD, 1.0), (KINECT_AZURE, AZURE_TO_WORLD, 1000.0)],
)
def test_other_kinects_are_told_by_their_joints(
    skeleton: Skeleton, to_world: np.ndarray, unit: float, tmp_path: Path
) -> None:
    poses = unit * seen_by(skeleton, to_world)
    path = tmp_path / "body.csv"
    names = [f"{name.upper()} {axis}" for name in skeleton.names for axis in "xyz"]
    path.write_text(lines(names, *map(cells, poses)))
    recording = read_recording(path)
    assert recording.skeleton.names == skeleton.names
    assert rises(recording.positions, skeleton.index("HandRight")) == pytest.approx(LIFT, abs=1e-3)


def azure(poses: np.ndarray, *, bodies: int = 1, **more: object) -> str:
    def spelled(name: str) -> str:
        return "".join(f"_{c}" if c.isupper() and i else c for i, c in enumerate(name)).upper()

    return json.dumps(
        {
            "k4abt_sdk_version": "1.1.2",
            "joint_names": [spelled(name) for name in KINECT_AZURE.names],
            "frames": [
                {
                    "timestamp_usec": 66_666 * frame,
                    "frame_id": frame,
                    "num_bodies": bodies,
                    "bodies": [
                        {
                            "body_id": 7 + body,
                            "joint_positions": (1000.0 * pose + 500.0 * body).tolist(),
                            "joint_orientations": [[1, 0, 0, 0]] * len(pose),
                        }
                        | more
                        for body in range(bodies)
                    ],
                }
                for frame, pose in enumerate(poses)
            ],
        },
        indent=4,
    )


def test_the_offline_processors_json(tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    path.write_text(azure(seen_by(KINECT_AZURE, AZURE_TO_WORLD), bodies=2))
    recording = read_recording(path)
    assert recording.performers.tolist() == [0, 1, 0, 1]
    np.testing.assert_allclose(recording.times, [0, 0, 0.066666, 0.066666])
    one = recording.of(0)
    assert rises(one.positions, KINECT_AZURE.index("HandRight")) == pytest.approx(LIFT, abs=1e-3)
    head, foot = (one.positions[0, KINECT_AZURE.index(name), 1] for name in ("Head", "FootLeft"))
    assert head - foot == pytest.approx(1.54, abs=0.01)
    assert one.rotations is not None
    np.testing.assert_allclose(np.abs(one.rotations[0, 0]), [1, 0, 0, 0], atol=0.03)


def test_levels_of_confidence(tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    levels = [0, 1, 2, 3] + [2] * 28
    path.write_text(azure(seen_by(KINECT_AZURE, AZURE_TO_WORLD), confidence_levels=levels))
    recording = read_recording(path)
    np.testing.assert_allclose(recording.confidence[0, :4], [0, 0.5, 1, 1])


@pytest.mark.parametrize("cut", [200, 2000, 4000])
def test_json_that_is_cut_off_is_one_line(cut: int, tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    path.write_text(azure(seen_by(KINECT_AZURE, AZURE_TO_WORLD))[:cut])
    with pytest.raises(InputError) as refused:
        read_recording(path)
    assert "\n" not in str(refused.value)
    assert str(path) in str(refused.value)
