"""The pictures of a performance for other programs, by way of other people's libraries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self

from runtime.output.output import PerformedFrame
from runtime.output.pictures import Picture, fitted


class Sender(Protocol):
    """What takes pictures to where other programs find them."""

    def send(self, picture: Picture) -> None:
        """Send a picture (H, W, 4), always of the same size, with straight alpha, top row first."""
        ...

    def close(self) -> None:
        """Be found no more."""
        ...


class Broadcast:
    """An output that sends every picture, and goes on showing while no performer is seen.

    A library that fails in the midst of a show is told, once, and the show goes on without it.

    Args:
        name: what it is called where it fails.
        sender: is closed with this.
        size: width and height [px] of what is sent; other pictures are made to fit.
        pictures_a_second: at most.
        tell: takes one line on what is wrong.
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
        except Exception as error:  # whatever a driver or another's library may raise
            self._tell(f"{self._name} has stopped ({error}); the show goes on without it")
            self.close()

    def close(self) -> None:
        """Send no more; may be called twice."""
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
