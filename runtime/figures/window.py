"""Pictures of the window with its panel, for the documents: drawn without a screen."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import moderngl
from PIL import Image

from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.control.actions import press
from runtime.control.flow_settings import FlowSettings
from runtime.driving.by_hand.pair_words import read_pair
from runtime.output.files.whole_file import whole_file
from runtime.panel.panel import Panel
from runtime.render.context import headless_context, release_headless
from runtime.session import edits
from runtime.session.files.store import SessionStore
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show

QUALITY = 90  # of 100
PAIRS = tuple(
    map(read_pair, ("left arm -> tentacle 3", "right arm -> tentacle 7", "head -> mantle"))
)
LAYOUTS = 6  # times that the panel is laid out before it is drawn: it finds its size


def draw_window(folder: Path, size: tuple[int, int]) -> list[str]:
    """Write a picture of the window for each stage of a show; return a line for each.

    Args:
        folder: where they are written; made if it is not there.
        size: width and height of the window [px].

    Raises:
        InputError: a picture cannot be written, or there is no OpenGL.
    """
    folder.mkdir(parents=True, exist_ok=True)
    context = headless_context()
    try:
        return [
            _draw(context, folder / f"{name}.jpg", size, stage)
            for name, stage in (
                ("matching", _match),
                ("performing", _perform),
                ("session", _layer),
                ("hands-free", _gesture),
                ("mapped", _map),
            )
        ]
    finally:
        release_headless(context)


def _draw(
    context: moderngl.Context, path: Path, size: tuple[int, int], stage: Callable[[Show], None]
) -> str:
    """Write a picture of a window in which something was done."""
    with TemporaryDirectory() as folder:
        store = SessionStore(Path(folder) / "show.bunraku") if stage in (_layer, _gesture) else None
        settings = ShowSettings(
            size=size,
            match=MatchSettings(rehearse=stage is not _match, pairs=PAIRS if stage is _map else ()),
            flow=FlowSettings(hands_free="raise" if stage is _gesture else ""),
            origin="wave.mcap",
        )
        stream = play(builtin_recording("wave"), every_frame=True, loop=True)
        characters = [load_character("squid")]
        with Show(stream, characters, settings, context=context, session=store) as show:
            stage(show)
            seconds = itertools.count()
            panel = Panel(
                context, show.controls, show._opened.status, clock=lambda: float(next(seconds))
            )
            target = context.simple_framebuffer(size, components=4)
            for _ in range(LAYOUTS):
                show.controls.loop.draw()  # clear of the panel, once that is laid out
                show.controls.scene.stage.show(target)  # type: ignore[union-attr]  # it draws
                panel.draw(target)
            read = target.read(components=3, alignment=1)
            panel.close()
            target.release()
    picture = Image.frombytes("RGB", size, read).transpose(Image.Transpose.FLIP_TOP_BOTTOM)
    with whole_file(path) as partial:
        picture.save(partial, format="JPEG", quality=QUALITY)
    return f"{path}: the window, {size[0]}x{size[1]}"


def _match(show: Show) -> None:
    """A match is looked for, and the best one is shown."""
    _tick(show, 8)
    press("next-match", show.controls)
    _tick(show, 30)


def _perform(show: Show) -> None:
    _tick(show, 45)


def _map(show: Show) -> None:
    """Parts were paired in words."""
    _tick(show, 45)


def _gesture(show: Show) -> None:
    """A gesture ends the take that is recorded."""
    _tick(show, 20)
    press("record", show.controls)
    _tick(show, 60)


def _layer(show: Show) -> None:
    """Three takes were recorded, and the first moment of them is shown."""
    _tick(show, 2)
    for frames in (100, 140, 70):
        press("record", show.controls)
        _tick(show, frames)
        press("record", show.controls)
    session = show.controls.session
    assert session is not None
    document = edits.moved(session.session, 2, 0.8)
    document = edits.moved(document, 3, 2.0)
    session.edit(edits.marked(document, 2.0, "bow"), "move a clip")
    session.transport.seek(1.2)
    _tick(show, 30)


def _tick(show: Show, frames: int) -> None:
    for _ in range(frames):
        show.tick()
