"""The onion skin: ghosts of the moments before and after, for the operator alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.control.actions import press
from runtime.session.files.store import SessionStore
from runtime.session.onion_skin import STEP, STEPS
from runtime.show.open_stream import play
from runtime.show.scene import Scene
from runtime.show.settings import ShowSettings
from runtime.show.show import Show

SIZE = (320, 180)


@pytest.fixture
def show(context: moderngl.Context, tmp_path: Path) -> Iterator[Show]:
    """A session with a take of two seconds, paused in its midst."""
    stream = play(builtin_recording("wave"), every_frame=True, loop=True)
    store = SessionStore(tmp_path / "a.bunraku")
    settings = ShowSettings(size=SIZE)
    with Show(
        stream, [load_character("mannequin")], settings, session=store, context=context
    ) as show:
        for frames in (2, 120):
            for _ in range(frames):
                show.tick()
            press("record", show.controls)
        assert show.controls.session is not None
        show.controls.session.transport.seek(1.0)
        for _ in range(40):  # until the performer has let go
            show.tick()
        yield show


def drawn(show: Show) -> np.ndarray:
    """What the operator sees."""
    scene = show.controls.scene
    assert isinstance(scene, Scene)
    show.controls.loop.draw()
    return scene.picture().astype(int)


def test_ghosts_are_what_plays_at_their_moments(show: Show) -> None:
    press("onion-skin", show.controls)
    session = show.controls.session
    assert session is not None
    ghosts = session.ghosts()
    assert [ghost.steps for ghost in ghosts] == list(STEPS)
    assert session.ghosts() is ghosts, "found once"
    for ghost in ghosts:
        session.transport.seek(1.0 + ghost.steps * STEP)
        show.tick()
        height = float(np.ptp(show.vertices[0][:, 1]))
        assert_allclose(ghost.vertices, show.vertices[0], atol=0.02 * height)
    assert session.ghosts() is not ghosts


def test_only_the_operator_sees_them_and_only_in_a_pause(show: Show) -> None:
    plain, output = drawn(show), show.picture
    press("onion-skin", show.controls)
    ghostly = drawn(show)
    red, _, blue = np.moveaxis((ghostly - plain)[..., :3], 2, 0)
    changed = np.abs(ghostly - plain).max(axis=2) > 8
    assert 100 < changed.sum() < 0.2 * changed.size
    assert (blue - red > 20).any(), "what was"
    assert (red - blue > 20).any(), "what will be"
    assert_array_equal(show.picture, output)
    assert_array_equal(drawn(show), ghostly)
    press("hold", show.controls)
    assert show.controls.session is not None
    assert show.controls.session.ghosts() == ()
    show.controls.session.transport.seek(1.0)
    press("hold", show.controls)
    press("onion-skin", show.controls)
    assert_array_equal(drawn(show), plain)


def test_ghosts_stand_behind_the_character(show: Show) -> None:
    """Where the character is opaque, nothing shines through."""
    scene = show.controls.scene
    assert isinstance(scene, Scene)
    scene.highlights = False
    plain = drawn(show)
    press("onion-skin", show.controls)
    ghostly = drawn(show)
    changed = np.abs(ghostly - plain)[..., :3].max(axis=2) > 8
    shown = np.abs(plain - _without(show))[..., :3].max(axis=2) > 60
    assert shown.sum() > 200
    assert changed[shown].mean() < 0.1


def _without(show: Show) -> np.ndarray:
    """The stage alone."""
    scene = show.controls.scene
    assert isinstance(scene, Scene)
    press("onion-skin", show.controls)
    scene.stage._characters[0].update(scene.stage._characters[0].character.vertices + 99.0)
    scene.redraw()
    return scene.picture().astype(int)


def test_no_session_has_no_onion_skin(show: Show) -> None:
    show.controls.session = None
    press("onion-skin", show.controls)
    assert show.controls.scene is not None
    assert show.controls.scene.ghosts is None
