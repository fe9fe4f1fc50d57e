"""The commands of a session: session, edit, render and info, from one file to the next."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from runtime.characters.open_character import load_character
from runtime.cli.command_line import main
from runtime.control.actions import press
from runtime.output.files.point_cache import read_point_cache
from runtime.session.store import SessionStore
from runtime.show.open_stream import open_stream
from runtime.show.show import Show
from tests.runtime.session.test_live_session import open_show, record


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A session of the squid with two takes."""
    path = tmp_path / "s.bunraku"
    with open_show(path, "squid") as show:
        record(show, 30)
        record(show, 30)
    return path
