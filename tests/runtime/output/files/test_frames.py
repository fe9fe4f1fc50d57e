"""PNG sequences: one whole picture a frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devices.errors import InputError
from runtime.output.files.frames import Frames
from tests.runtime.tentacle import make_show, make_tentacle

SIZE = (33, 21)


def test_the_folder_holds_every_picture_in_order(tmp_path: Path) -> None:
    show = make_show(make_tentacle(), frames=4, size=SIZE)
    with Frames(tmp_path / "out") as frames:
        for frame in show:
            frames.write(frame)
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["000000.png", "000001.png", "000002.png", "000003.png"]
    for name, frame in zip(names, show, strict=True):
        with Image.open(tmp_path / "out" / name) as image:
            assert image.mode == "RGB"
            np.testing.assert_array_equal(np.asarray(image), frame.picture[..., :3])


def test_transparency_is_kept(tmp_path: Path) -> None:
    frame = make_show(make_tentacle(), frames=1, size=SIZE)[0]
    picture = frame.picture.copy()
    picture[3:6, 4:9, 3] = 100
    with Frames(tmp_path) as frames:
        frames.write(replace(frame, picture=picture))
    with Image.open(tmp_path / "000000.png") as image:
        np.testing.assert_array_equal(np.asarray(image), picture)


def test_pictures_of_an_earlier_longer_show_go_and_nothing_else_does(tmp_path: Path) -> None:
    for name in ("000001.png", "000002.png", "7.png", "000007.jpg", "poster.png"):
        (tmp_path / name).touch()
    with Frames(tmp_path) as frames:
        pass
    assert len(list(tmp_path.iterdir())) == 5
    with Frames(tmp_path) as frames:
        for frame in make_show(make_tentacle(), frames=2, size=SIZE):
            frames.write(frame)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["000000.png", "000001.png", "000007.jpg", "7.png", "poster.png"]


def test_a_place_that_is_no_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is not a folder"):
        Frames(tmp_path / "file")
    with pytest.raises(InputError, match="No such file or directory"):
        Frames(tmp_path / "missing" / "out")
