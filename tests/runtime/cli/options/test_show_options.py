"""Options become settings at one place: every value arrives, the last one also for the rest."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from devices.errors import InputError
from runtime.cli import parser
from runtime.cli.options.flow_options import flow_settings
from runtime.cli.options.output_options import file_settings
from runtime.cli.options.show_options import show_settings
from runtime.control.flow_settings import FlowSettings
from runtime.driving.by_hand.pair_words import WordedPair
from runtime.render.background import NOTHING, Background
from runtime.show.settings import (
    CharacterSettings,
    FileSettings,
    MatchSettings,
    RemoteSettings,
    SenderSettings,
    ShowSettings,
)


def settings_of(*options: str, characters: int = 1) -> ShowSettings:
    """What `bunraku live` asks for with these options."""
    command = ["live", "--device", "sim://", *characters * ["--character", "squid"], *options]
    return show_settings(parser().parse_args(command), "sim://")


def test_without_options_the_settings_are_the_usual_ones_in_a_window() -> None:
    assert settings_of() == ShowSettings(window=True, origin="sim://")
    assert settings_of("--headless") == ShowSettings(origin="sim://")


def test_the_last_value_is_also_for_all_that_follow() -> None:
    settings = settings_of(
        "--cartoon", "1", "--cartoon", "0.5", "--energy", "smooth-rotations",
        "--stiffness", "0.1", "--stiffness", "0.2", "--stiffness", "0.3", "--iterations", "3",
        characters=4,
    )  # fmt: skip
    assert [one.cartoon for one in settings.characters] == [1.0, 0.5, 0.5, 0.5]
    assert [one.stiffness for one in settings.characters] == [0.1, 0.2, 0.3, 0.3]
    assert {one.energy for one in settings.characters} == {"smooth-rotations"}
    assert {one.iterations for one in settings.characters} == {3}
    assert {one.volume_gain for one in settings.characters} == {CharacterSettings().volume_gain}


def test_every_option_arrives() -> None:
    settings = settings_of(
        "--size", "64x48", "--plain", "--background", "#010203", "--fps", "30",
        "--source", "arms", "--performers", "1", "--match", "3", "--mapping", "m.json",
        "--drive", "relative", "--chains", "stop", "--flip", "--in-place", "--volume-gain", "2",
        "--countdown", "never", "--count-in", "5",
        "--hands-free", "clap", "--no-outliers", "--mirror",
        "--video", "v.mp4", "--frames", "p", "--cache", "c.pc2", "--report", "r.json",
        "--record", "o.mcap", "--export", "e.glb",
        "--virtual-camera", "--ndi", "n", "--spout", "s", "--vmc", "127.0.0.1:1",
        "--publish", "tcp://127.0.0.1:2", "--publish-keys", "k",
        "--remote", "127.0.0.1:3", "--remote-feedback", "4",
    )  # fmt: skip
    assert settings == ShowSettings(
        size=(64, 48),
        window=True,
        background=Background(1, 2, 3),
        plain=True,
        fps=30.0,
        match=MatchSettings(
            "arms",
            1,
            3,
            Path("m.json"),
            extend=False,
            flip=True,
            driver="relative",
            in_place=True,
            patience=math.inf,
        ),
        characters=(CharacterSettings(volume_gain=2.0),),
        conditioning={"outliers": False, "mirror": True},
        files=FileSettings(
            Path("v.mp4"), Path("p"), Path("c.pc2"), Path("r.json"), Path("o.mcap"), Path("e.glb")
        ),
        senders=SenderSettings("", "n", "s", ("127.0.0.1", 1), "tcp://127.0.0.1:2", Path("k")),
        remote=RemoteSettings(("127.0.0.1", 3), 4),
        flow=FlowSettings(count_in=5.0, hands_free="clap"),
        origin="sim://",
    )
    assert settings_of("--transparent").background == NOTHING
    pairs = settings_of("--map", "left arm -> tentacle 3", "--map", "head→mantle").match.pairs
    assert pairs == (WordedPair("left arm", "tentacle 3"), WordedPair("head", "mantle"))
    assert settings_of("--hands-free", "pose").flow == FlowSettings(3.0, "pose")


def test_the_demo_has_a_size_and_a_rate_of_its_own() -> None:
    options = parser().parse_args(["demo", "--character", "squid"])
    settings = show_settings(options, "show")
    assert (settings.size, settings.fps) == ((1280, 560), 30.0)


@pytest.mark.parametrize(
    ("options", "about"),
    [
        (("--performers", "2"), "--performers 2"),
        (("--remote-feedback", "9000"), "--remote-feedback"),
        (("--drive", "absolute", "--match", "2"), "--match"),
        (("--drive", "absolute", "--chains", "stop"), "--chains stop"),
        (("--drive", "absolute", "--mapping", "m.json"), "--mapping"),
        (("--drive", "absolute", "--flip"), "--flip"),
        (("--drive", "absolute", "--map", "head -> mantle"), "--map"),
        (("--mapping", "m.json", "--map", "head -> mantle"), "--map and --mapping"),
        (("--map", "head mantle"), "is no pair: expected one such as"),
    ],
)
def test_options_that_contradict_each_other_are_refused_by_their_names(
    options: tuple[str, ...], about: str
) -> None:
    with pytest.raises(InputError, match=about):
        settings_of(*options)


def test_no_field_of_the_settings_is_forgotten() -> None:
    """A new setting is either set by an option, and tried above, or is for the library alone."""
    for_the_library = {
        ShowSettings: {"pictures", "kiosk"},  # `bunraku session` alone has a kiosk
        MatchSettings: {"rehearse"},
        FileSettings: {"takes", "video_sound"},  # a session's takes bring their own sound
    }
    source = "".join(
        Path(str(made.__code__.co_filename)).read_text(encoding="utf-8")
        for made in (show_settings, file_settings, flow_settings)
    )
    for kind in (
        ShowSettings, MatchSettings, CharacterSettings, FileSettings, SenderSettings, FlowSettings
    ):  # fmt: skip
        for field in dataclasses.fields(kind):
            is_set = f"{field.name}=" in source
            assert is_set is (field.name not in for_the_library.get(kind, set())), field.name


@pytest.mark.parametrize("arguments", [["--version"], ["replay", "--help"]])
def test_version_and_help_end_the_program_well(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        parser().parse_args(arguments)
    assert ended.value.code == 0
    assert "bunraku" in capsys.readouterr().out
