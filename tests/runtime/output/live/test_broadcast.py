"""What every broadcast of pictures does, and what it says when its library is missing."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from devices.errors import InputError
from runtime.cli import main
from runtime.output.live.broadcast import Broadcast
from runtime.output.live.shared_texture import import_shared_texture
from runtime.output.output import Output, PerformedFrame, Screen

RED, BLUE, CLEAR = (250, 20, 10, 255), (10, 40, 240, 255), (0, 0, 0, 0)


def picture(size: tuple[int, int] = (6, 4)) -> np.ndarray:
    """Red above, blue below, a half-transparent white pixel at the upper right."""
    width, height = size
    made = np.empty((height, width, 4), np.uint8)
    made[: height // 2], made[height // 2 :] = RED, BLUE
    made[0, -1] = 255, 255, 255, 128
    return made


def performed(index: int, shown: np.ndarray | None) -> PerformedFrame:
    empty = np.zeros((0, 3))
    return PerformedFrame(index, index / 30.0, empty, None, picture=shown)


class Wire:
    """A sender that keeps what it is given, and breaks when it is told to."""

    def __init__(self) -> None:
        self.pictures: list[np.ndarray] = []
        self.breaks = self.closed = False

    def send(self, shown: np.ndarray) -> None:
        if self.breaks:
            raise RuntimeError("unplugged")
        self.pictures.append(shown.copy())

    def close(self) -> None:
        self.closed = True


def test_every_picture_is_sent_in_order_at_one_size_and_more_while_nobody_is_seen() -> None:
    wire, told = Wire(), []
    with Broadcast("it", wire, (6, 4), 30.0, tell=told.append) as output:
        kept: Output = output
        assert isinstance(output, Screen)
        kept.write(performed(0, picture()))
        kept.write(performed(1, None))  # not every frame has one
        kept.write(performed(2, 255 - picture((12, 8))))
        output.show(picture())
    output.close()
    assert wire.closed
    assert [one.shape for one in wire.pictures] == [(4, 6, 4)] * 3
    np.testing.assert_array_equal(wire.pictures[0], picture())
    np.testing.assert_array_equal(wire.pictures[2], picture())
    assert told == []


def test_a_library_that_fails_is_told_once_and_the_show_goes_on() -> None:
    wire, told = Wire(), []
    output = Broadcast("the camera", wire, (6, 4), 30.0, tell=told.append)
    wire.breaks = True
    for index in range(5):
        output.write(performed(index, picture()))
    assert told == ["the camera has stopped (unplugged); the show goes on without it"]
    assert wire.closed
    output.close()


@pytest.mark.parametrize(
    ("option", "module", "extra"),
    [("--virtual-camera", "pyvirtualcam", "camera"), ("--ndi", "cyndilib", "ndi")],
)
def test_a_missing_library_is_one_line_that_names_the_extra(
    option: str,
    module: str,
    extra: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert main(["demo", "--headless", "--fast", option, "name"]) == 2
    line = capsys.readouterr().err
    assert line.endswith(f"{option} needs the extra: pip install 'bunraku[{extra}]'\n")
    assert line.count("\n") == 1


@pytest.mark.parametrize(("platform", "module"), [("win32", "SpoutGL"), ("darwin", "syphon")])
def test_spout_names_its_extra_where_it_could_be_and_says_so_where_it_cannot(
    platform: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r"--spout needs the extra: pip install 'bunraku\[spout]'"):
        import_shared_texture(platform)
    with pytest.raises(InputError, match="neither here; use --ndi or --virtual-camera"):
        import_shared_texture("linux")
