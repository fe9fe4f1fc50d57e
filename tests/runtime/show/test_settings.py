"""Settings are checked where they are made, and a bad one is named."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import solvers.arap
from devices.errors import InputError
from runtime.conditioning.switches import SWITCHES
from runtime.render.background import NOTHING, Background
from runtime.show.settings import (
    ENERGIES,
    CharacterSettings,
    FileSettings,
    MatchSettings,
    RemoteSettings,
    SenderSettings,
    ShowSettings,
)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: CharacterSettings(cartoon=1.1), "CharacterSettings.cartoon"),
        (lambda: CharacterSettings(cartoon=math.nan), "CharacterSettings.cartoon"),
        (lambda: CharacterSettings(volume_gain=-0.1), "CharacterSettings.volume_gain"),
        (lambda: CharacterSettings(stiffness=1.0), "CharacterSettings.stiffness"),
        (lambda: CharacterSettings(energy="rigid"), "CharacterSettings.energy"),
        (lambda: CharacterSettings(iterations=0), "CharacterSettings.iterations"),
        (lambda: MatchSettings(performers=0), "MatchSettings.performers"),
        (lambda: MatchSettings(rank=0), "MatchSettings.rank"),
        (lambda: MatchSettings(patience=-1.0), "MatchSettings.patience"),
        (lambda: FileSettings(video="out.mp4"), "FileSettings.video"),
        (lambda: SenderSettings(publish_keys="keys"), "SenderSettings.publish_keys"),
        (lambda: ShowSettings(size=(15, 64)), "ShowSettings.size"),
        (lambda: ShowSettings(size=(64, 9000)), "ShowSettings.size"),
        (lambda: ShowSettings(size=100), "ShowSettings.size"),
        (lambda: ShowSettings(size=(100.5, 100)), "ShowSettings.size"),
        (lambda: ShowSettings(background="red"), "ShowSettings.background"),
        (lambda: ShowSettings(characters=CharacterSettings()), "ShowSettings.characters"),
        (lambda: ShowSettings(conditioning={"mirror": "yes"}), "ShowSettings.conditioning"),
        (lambda: ShowSettings(fps=math.inf), "ShowSettings.fps"),
        (lambda: ShowSettings(fps="fast"), "ShowSettings.fps"),
        (lambda: CharacterSettings(cartoon="much"), "CharacterSettings.cartoon"),
        (lambda: CharacterSettings(iterations=True), "CharacterSettings.iterations"),
        (lambda: SenderSettings(vmc=("localhost", 70_000)), "SenderSettings.vmc"),
        (lambda: RemoteSettings(("127.0.0.1", 99_999)), "RemoteSettings.address"),
        (lambda: RemoteSettings(("127.0.0.1", None), -1), "RemoteSettings.feedback_port"),
        (lambda: ShowSettings(characters=()), "ShowSettings.characters"),
        (lambda: ShowSettings(conditioning={"polish": True}), "ShowSettings.conditioning"),
    ],
)
def test_a_bad_value_is_refused_in_one_line_that_names_the_setting(
    make: Callable[[], Any], named: str
) -> None:
    with pytest.raises(InputError, match=named) as refused:
        make()
    assert "\n" not in str(refused.value)


def test_an_unknown_step_of_the_conditioning_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError) as refused:
        ShowSettings(conditioning={"polish": True})
    for name in SWITCHES:
        assert name in str(refused.value)


def test_settings_stay_as_they_are_and_are_equal_by_value() -> None:
    settings = ShowSettings(match=MatchSettings(source="arms"))
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.fps = 30.0  # type: ignore[misc]  # what is tried
    assert settings == ShowSettings(match=MatchSettings(source="arms"))
    assert dataclasses.replace(settings, fps=30.0).match.source == "arms"


@pytest.mark.parametrize(
    ("settings", "needed"),
    [
        (ShowSettings(), False),
        (ShowSettings(files=FileSettings(cache=Path("c.pc2"))), False),
        (ShowSettings(senders=SenderSettings(vmc=("127.0.0.1", None))), False),
        (ShowSettings(pictures=True), True),
        (ShowSettings(files=FileSettings(video=Path("v.mp4"))), True),
        (ShowSettings(files=FileSettings(frames=Path("pictures"))), True),
        (ShowSettings(senders=SenderSettings(virtual_camera="")), True),
        (ShowSettings(senders=SenderSettings(ndi="show")), True),
        (ShowSettings(senders=SenderSettings(spout="show")), True),
    ],
)
def test_a_show_draws_only_where_something_needs_its_pictures(
    settings: ShowSettings, needed: bool
) -> None:
    assert settings.needs_pictures is needed


def test_only_a_background_that_is_not_there_is_transparent() -> None:
    assert not ShowSettings().transparent
    assert not ShowSettings(background=Background(0, 255, 0)).transparent
    assert ShowSettings(background=NOTHING).transparent


def test_the_energies_are_those_of_the_solver() -> None:
    assert solvers.arap.ENERGIES == ENERGIES


@pytest.mark.parametrize(
    "settings",
    [
        ShowSettings(window=True),
        ShowSettings(files=FileSettings(report=Path("r.json"))),
        ShowSettings(senders=SenderSettings(vmc=("127.0.0.1", None))),
        ShowSettings(remote=RemoteSettings(("127.0.0.1", 0))),
    ],
    ids=["window", "file", "sender", "remote"],
)
def test_a_show_is_noticed_by_any_way_out(settings: ShowSettings) -> None:
    assert settings.is_noticed
    assert not ShowSettings().is_noticed
