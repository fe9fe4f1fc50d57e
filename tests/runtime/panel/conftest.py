"""Fixtures of the panel: a show with one figure, and its panel on a screen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import pytest

from replay.player import EveryFrame, Player
from tests.runtime.panel.screen import Screen
from tests.runtime.staged import StagedShow
from tests.runtime.stick_figures import make_figure, record, waving


@pytest.fixture
def show(context: moderngl.Context, tmp_path: Path) -> Iterator[StagedShow]:
    stream = Player(record(waving(60)), EveryFrame())
    show = StagedShow(context, make_figure(), stream, tmp_path)
    show.loop.tick()
    yield show
    show.close()


@pytest.fixture
def screen(context: moderngl.Context, show: StagedShow) -> Iterator[Screen]:
    screen = Screen(context, show)
    yield screen
    screen.panel.close()
    screen.target.release()
