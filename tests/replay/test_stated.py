"""What a user states of a recording comes before what its reader guesses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from replay.formats import read_recording
from replay.stated import Stated
from runtime.cli import main
from tests.replay.bvh.test_reader import body


@pytest.fixture
def take(tmp_path: Path) -> Path:
    path = tmp_path / "take.bvh"
    path.write_text(body())
    return path


def test_a_stated_rate_replaces_the_times(take: Path) -> None:
    assert read_recording(take, Stated(rate=50.0)).times.tolist() == [0.0, 0.02]


def test_a_stated_unit_and_axis_replace_the_guess(take: Path) -> None:
    guessed, said = read_recording(take), read_recording(take, Stated(unit="m", up="z"))
    size = [np.ptp(found.positions[0], axis=0) for found in (guessed, said)]
    np.testing.assert_allclose(size[1][[0, 2, 1]], 100.0 * size[0], rtol=1e-9)
    assert not any("-input" in note for note in said.notes)


def test_a_mirrored_file_is_turned_back(take: Path) -> None:
    plain, turned = read_recording(take), read_recording(take, Stated(mirrored=True))
    left, right = (plain.skeleton.index(f"{side}Hand") for side in ("Left", "Right"))
    np.testing.assert_allclose(turned.positions[:, left], plain.positions[:, right] * [-1, 1, 1])


def test_what_a_file_says_itself_cannot_be_stated(take: Path, tmp_path: Path) -> None:
    main(["convert", str(take), str(tmp_path / "a.csv")])
    with pytest.raises(InputError, match="--unit-input says what its format says"):
        read_recording(tmp_path / "a.csv", Stated(unit="cm"))
    with pytest.raises(InputError, match="'ell' is no unit of length; use m, dm"):
        Stated(unit="ell")


def test_the_commands_take_what_is_stated(
    take: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = ["--fps-input", "50", "--unit-input", "CM", "--up-input=+Y", "--mirror-input"]
    assert main(["info", str(take), *said]) == 0
    assert "50.00 frames/s" in capsys.readouterr().out
    assert main(["convert", str(take), str(tmp_path / "a.mcap"), *said]) == 0
    assert read_recording(tmp_path / "a.mcap").times.tolist() == [0.0, 0.02]
    assert main(["info", str(take), "--up-input", "w"]) == 2
    assert "'w' is no axis; use x, y, z" in capsys.readouterr().err
