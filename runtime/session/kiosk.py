"""A show that nobody operates: the session plays until somebody comes, and again afterwards."""

from __future__ import annotations

import math

from runtime.session.transport import Mode, Transport


class Kiosk:
    """Plays the session again and again while nobody is seen.

    Args:
        transport: of the session.
        patience: [s] after somebody has left until the session plays.
    """

    def __init__(self, transport: Transport, patience: float) -> None:
        self._transport, self._patience = transport, patience
        self._seen = -math.inf
        transport.loop = True

    def follow(self, time: float, *, seen: bool) -> None:
        """Go on to a frame of the show.

        Args:
            time: [s].
            seen: whether a performer is in view.
        """
        transport = self._transport
        if seen:
            self._seen = time
            if transport.mode in (Mode.PLAYING, Mode.PAUSED):
                transport.rehearse()
        elif transport.mode is Mode.REHEARSING and time - self._seen > self._patience:
            transport.go_to(0.0)
            transport.resume()
