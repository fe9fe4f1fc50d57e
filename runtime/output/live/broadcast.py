"""Output of pictures to other programs, through third-party libraries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self

from runtime.output.output import PerformedFrame
from runtime.output.pictures import Picture, fitted


class Sender(Protocol):
    """Sends pictures to other programs."""

    def send(self, picture: Picture) -> None:
        """Send a picture (H, W, 4), always of the same size, with straight alpha, top row first."""
        ...

    def close(self) -> None:
        """Stop sending."""
        ...


class Broadcast:
    """Sends every picture, also while no performer is seen.

    When the library fails during a show, one line reports it and the show goes on without it.

    Args:
        name: the name of this output in error lines.
        sender: closed with this output.
        size: width and height [px] to send; other pictures are scaled to fit.
        pictures_a_second: most pictures per second.
        tell: takes one line that reports a failure.
    """

    def __init__(
        self,
        name: str,
        sender: Sender,
        size: tuple[int, int],
        pictures_a_second: float,
        *,
        tell: Callable[[str], None],
    ) -> None:
        self.pictures_a_second = pictures_a_second
        self._name = name
        self._sender: Sender | None = sender
        self._size = size
        self._tell = tell

    def write(self, frame: PerformedFrame) -> None:
        """Send the frame's picture, if it has one."""
        if frame.picture is not None:
            self.show(frame.picture)

    def show(self, picture: Picture) -> None:
        """Send a picture."""
        if self._sender is None:
            return
        try:
            self._sender.send(fitted(picture, self._size))
        except Exception as error:  # drivers and third-party libraries raise anything
            self._tell(f"{self._name} has stopped ({error}); the show goes on without it")
            self.close()

    def close(self) -> None:
        """Stop sending; may be called twice."""
        sender, self._sender = self._sender, None
        if sender is None:
            return
        try:
            sender.close()
        except Exception as error:  # as above
            self._tell(f"{self._name} did not end well ({error})")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
