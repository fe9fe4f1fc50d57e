"""A show: the frames of a stream drive characters, in a window or without one.

The command line, the doctor, the benchmarks and the tests all build their shows here.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from devices.stream import SkeletonStream
from replay.playback import Playback, playback_of
from runtime.characters.character import Character
from runtime.driving.drivers import DriverFactory
from runtime.output.files.kept_file import Kept
from runtime.output.output import Output
from runtime.output.report.report import Report
from runtime.puppet.puppet import Motion
from runtime.session.files.store import SessionStore
from runtime.show import messages
from runtime.show.collector_pauses import collector_paused, objects_frozen
from runtime.show.interrupts import interrupts_deferred
from runtime.show.opening.opened_show import OpenedShow
from runtime.show.pacing import Pace, SpareTime, pace_of
from runtime.show.scene import Scene
from runtime.show.settings import ShowSettings

if TYPE_CHECKING:
    import moderngl


class Show:
    """Drives characters by the frames of a stream.

    A file whose disk fails is told to `warn`, and the show goes on without it: see `kept`.

    The constructor opens everything: the solvers, the window, every file. `close`, or the end of a
    ``with`` block, finishes every file, also after an error. `run` performs to the end; a loop of
    your own calls `tick` as often as it likes.

    A show belongs to the thread that made it. Several shows may take turns on one thread.

    Args:
        stream: where the frames come from; it is closed with the show, and when this fails.
        characters: the characters on stage, from left to right.
        settings: everything else; the defaults perform without a window, a picture or a file.
        pace: waits between the ticks of `run`; if None, the one that suits the stream.
        outputs: outputs of your own that take each frame of the first character.
        session: where takes are kept and played from; it is saved and closed with the show.
        context: an OpenGL 3.3 context of your own, in which every tick draws; the show makes it
            current and does not release it. If None, a show that needs pictures makes one.
        make_scene: makes the scene, with the arguments of `Scene`.
        make_driver: makes the driver of each puppet; if None, the settings name it.
        clock: host monotonic time [s].
        tell: takes one line of what happened, such as a take that began; if None, nobody does.
        warn: takes one line about a fault that does not end the show; if None, the line goes to
            standard error.

    Attributes:
        settings: as given.
        controls: the parts of the show that actions change, such as the loop, the takes and the
            scene; ``ACTIONS["accept"].press(show.controls)`` of `runtime.control.actions` accepts
            the match.
        acts: each performer with their puppets and their match session.
        puppets: the characters as they are driven.

    Raises:
        InputError: a file or device cannot be opened, or settings do not fit the characters or the
            performer. Everything opened until then is closed.
    """

    def __init__(
        self,
        stream: SkeletonStream,
        characters: Sequence[Character],
        settings: ShowSettings | None = None,
        *,
        pace: Pace | None = None,
        outputs: Sequence[Output] = (),
        session: SessionStore | None = None,
        context: moderngl.Context | None = None,
        make_scene: Callable[..., Scene] = Scene,
        make_driver: DriverFactory | None = None,
        clock: Callable[[], float] = time.perf_counter,
        tell: Callable[[str], None] | None = None,
        warn: Callable[[str], None] | None = None,
    ) -> None:
        self.settings = settings or ShowSettings()
        self._stream = stream
        self._thread = threading.get_ident()
        self._closing = ExitStack()
        try:
            with collector_paused():
                self._opened = OpenedShow(
                    stream,
                    characters,
                    self.settings,
                    self._closing,
                    outputs=outputs,
                    session=session,
                    context=context,
                    make_scene=make_scene,
                    make_driver=make_driver,
                    clock=clock,
                    tell=tell or _nobody,
                    warn=warn or messages.warn,
                )
        except BaseException:
            self.close()
            raise
        self._loop, self._scene = self._opened.loop, self._opened.scene
        self.controls = self._opened.controls
        self.acts, self.puppets = self._opened.acts, self._opened.puppets
        self._pace = pace or pace_of(stream)
        self._spare_time = SpareTime(self._pace, self._loop)

    # -- Performing --------------------------------------------------------------------------------

    def tick(self) -> bool:
        """Perform the newest frame that has come since the last tick, without waiting for one.

        A tick also draws the window and handles its keys and the remote control.

        Returns:
            Whether a frame had come.
        """
        self._enter_graphics()
        with interrupts_deferred():  # so that all outputs have the same frames
            performed = self._loop.tick()
        self._opened.tell_sight()
        if self._opened.window_controls is not None:
            self._opened.window_controls.present()
            self._opened.window_controls.serve()
        if self._opened.remote is not None:
            self._opened.remote.serve(self.controls)
        if self._opened.hands_free is not None and performed:
            self._opened.hands_free.follow()
        if self.controls.session is not None:
            self.controls.session.note_setups()
        return performed

    def settle(self) -> None:
        """Let the surfaces settle if the next tick is not due yet; at most once a tick.

        Without it the next tick begins by settling them.
        """
        self._spare_time.spend()

    def wait(self) -> None:
        """Settle the surfaces, then sleep until the next tick is due."""
        self.settle()
        self._pace.wait()

    def run(self, then: Callable[[], object] = lambda: None) -> None:
        """Perform until the show has ended; `then` is called after each performed frame."""
        with objects_frozen():
            while not self.ended:
                if self.tick():
                    then()
                self.wait()

    @property
    def ended(self) -> bool:
        """Whether the stream has ended, or the window or an action asked to leave."""
        return self._stream.ended or self.controls.leaving

    # -- Results -----------------------------------------------------------------------------------

    @property
    def frames(self) -> int:
        """How many frames were performed."""
        return self._loop.frames

    @property
    def latency(self) -> float:
        """[s] from the arrival of the newest frame until it was performed; NaN if unknown."""
        return self._loop.latency

    @property
    def motions(self) -> Sequence[Motion]:
        """Vertices and nodes of each character as they are now; ticks to come overwrite them."""
        return self._loop.motions

    @property
    def vertices(self) -> list[NDArray[np.float64]]:
        """The deformed vertices of each character (N, 3) [m] on the stage, as copies."""
        return [motion.vertices.copy() for motion in self.motions]

    @property
    def picture(self) -> NDArray[np.uint8]:
        """A picture of the show as it is now, (H, W, 4): sRGB, straight alpha, top row first.

        Raises:
            ValueError: the show does not draw.
        """
        if self._scene is None:
            raise ValueError(
                "Expected a show that draws, got one without: make it with "
                "ShowSettings(pictures=True)"
            )
        self._enter_graphics()
        with self._scene.for_outputs():
            self._loop.draw()
        return self._scene.picture()

    @property
    def report(self) -> Report:
        """The figures of the show so far; ``report.summary()`` has the keys of docs/outputs.md."""
        self._opened.complete_report()
        return self._opened.report

    @property
    def kept(self) -> list[Kept]:
        """What lies where the show wrote files, and with what fault; once it is closed."""
        return self._opened.written.kept

    @property
    def playback(self) -> Playback | None:
        """The playback of a recording: position, speed, pause, loop; None when live."""
        return playback_of(self._stream)

    def seek(self, seconds: float) -> None:
        """Go on from the first frame at or after `seconds` of the recording.

        Surfaces, filters and matches go on from their present state. For the same bytes as playing
        to that frame, jump with `runtime.show.history.ShowHistory`.

        Raises:
            ValueError: the stream is live.
        """
        if self.playback is None:
            raise ValueError("Expected a recording to seek in, got a live stream")
        self.playback.seek(seconds)

    # -- Closing -----------------------------------------------------------------------------------

    def close(self) -> None:
        """Finish every file and close everything, the stream too; may be called twice."""
        with interrupts_deferred():  # a second Ctrl-C leaves no half file
            self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _enter_graphics(self) -> None:
        """Make this show's OpenGL context current: another show may have drawn since.

        Raises:
            ValueError: on a thread that did not make the show.
        """
        if self._scene is None:
            return
        if threading.get_ident() != self._thread:
            raise ValueError(
                "Expected the thread that made the show, got another: a show that draws belongs "
                "to one thread"
            )
        self._opened.display.make_current()


def _nobody(_: str) -> None:
    """Take a line, and tell nobody."""
