"""The front of the library: its names, what they load, and where they lead."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import runtime
from devices.builtin.simulator import Simulator
from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.mcap.writer import McapWriter
from replay.player import Player
from runtime import open_stream
from runtime.version import program_version


def test_every_name_is_there_and_every_other_is_not() -> None:
    for name in runtime.__all__:
        assert getattr(runtime, name).__name__ == name
        assert name in dir(runtime)
    with pytest.raises(AttributeError, match="nothing"):
        runtime.nothing  # noqa: B018  # that it raises is the test


def test_the_types_are_those_of_the_names() -> None:
    """The names under TYPE_CHECKING, which type checkers see, are those that are loaded."""
    source = Path(str(runtime.__file__)).read_text(encoding="utf-8")
    typed = {
        alias.name: node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("runtime.")
        for alias in node.names
    }
    assert set(typed) == set(runtime.__all__)
    for name, module in typed.items():
        assert getattr(runtime, name).__module__ == module


def test_every_package_says_that_it_is_typed() -> None:
    checkout = Path(__file__).resolve().parents[2]
    for package in ("runtime", "devices", "solvers", "replay"):
        assert (checkout / package / "py.typed").is_file()


def test_a_device_or_a_recording_is_opened(tmp_path: Path) -> None:
    path = tmp_path / "wave.mcap"
    played = builtin_recording("wave")
    with McapWriter(path, played.skeleton) as writer:
        for index in range(3):
            writer.write(played.frame(index))
    for source in (path, str(path)):
        with open_stream(source, every_frame=True) as stream:
            assert isinstance(stream, Player)
            assert [len(stream.poll()) for _ in range(4)] == [1, 1, 1, 0]
            np.testing.assert_allclose(stream.recording.positions, played.positions[:3])
    with open_stream(path, speed=2.0, loop=True) as stream:
        assert isinstance(stream, Player)
        assert stream.loop
        assert not stream.every_frame
    with open_stream("sim://wave") as stream:
        assert isinstance(stream, Simulator)


@pytest.mark.parametrize(
    ("source", "about"),
    [("nowhere.bvh", "nowhere"), ("carrier-pigeon://a", "carrier"), ("sim://sleep", "sleep")],
)
def test_what_cannot_be_opened_is_refused(source: str, about: str) -> None:
    with pytest.raises(InputError, match=about):
        open_stream(source)


def test_options_of_recordings_are_refused_for_devices() -> None:
    with pytest.raises(InputError, match="recordings"):
        open_stream("sim://wave", every_frame=True)


def test_the_version_is_known() -> None:
    assert program_version()[0].isdigit()
