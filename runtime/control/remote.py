"""A remote control over OSC: a phone or a foot pedal runs the show from where the performer stands.

``/bunraku/ACTION`` presses an action of `runtime.control.actions`: it is done without an argument
or with 1, and not with 0, which buttons send when they are let go. A fader is set by its value in
[0, 1], a switch by ``/bunraku/ACTION/set``. Whoever spoke last is told how things are, as
``/bunraku/state/ACTION``, so that lights and faders follow.
"""

from __future__ import annotations

import ipaddress
import math
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Self

from devices.errors import InputError
from devices.osc.messages import (
    Argument,
    Message,
    OscError,
    read_packet,
    write_bundles,
    write_message,
)
from devices.transport.udp import UdpTransport
from runtime.control.actions import ACTIONS, ShowControls

PORT = 9100
ROOT = "/bunraku/"
STATE = ROOT + "state/"
SET = "/set"
WAITING = 64  # presses that wait for a tick at most
AT_ONCE = 8  # presses that a tick does at most: a flood of them does not hold up the show
ANSWERS = 10.0  # a second, at most
REPEATED = 1.0  # [s] after which all is told again, since datagrams get lost
LONGEST = 1472  # bytes of a bundle in an Ethernet packet
MOST_COMPLAINTS = 8
PATIENCE = 2.0  # [s] that closing waits for the reader thread


@dataclass(frozen=True, slots=True)
class Wish:
    """What one message asks for.

    Attributes:
        action: its name.
        value: what to set it to, in [0, 1], or None to press it.
    """

    action: str
    value: float | None = None


class WishError(ValueError):
    """A message that asks for nothing that there is."""


def wish_of(message: Message) -> Wish | None:
    """What a message asks for; None for a button that is let go.

    Raises:
        WishError: there is no such action, or its value is missing or none.
    """
    name = message.address.removeprefix(ROOT)
    sets = name.endswith(SET)
    name = name.removesuffix(SET)
    action = ACTIONS.get(name)
    if action is None or not message.address.startswith(ROOT) or (sets and action.write is None):
        raise WishError("there is no such action, see docs/remote.md")
    value = _value(message.arguments)
    if sets or action.press is None:
        if value is None:
            raise WishError("it needs a value from 0 to 1")
        return Wish(name, min(max(value, 0.0), 1.0))
    return Wish(name) if value is None or value >= 0.5 else None


def _value(arguments: tuple[Argument, ...]) -> float | None:
    """The one number that is there, or None where nothing is.

    Raises:
        WishError: there is something else.
    """
    if not arguments:
        return None
    (first, *more) = arguments
    if more or not isinstance(first, int | float) or math.isnan(first):
        raise WishError("its value is not one number")
    return float(first)


class Remote:
    """Listens for wishes on a thread of its own; the frame loop's thread fulfils them.

    Args:
        host, port: where it listens; port 0 takes any free one.
        answer_port: where senders listen; 0 where they listen on the port that they send from.
        tell: takes one line on a message that asks for nothing that there is.
        clock: host monotonic time [s].

    Attributes:
        host, port: what it is bound to.
        refused: messages that were not understood.
        dropped: wishes that came faster than they could be fulfilled.

    Raises:
        InputError: the port cannot be had; the message says why.
    """

    def __init__(
        self,
        host: str,
        port: int = PORT,
        *,
        answer_port: int = 0,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.refused = self.dropped = 0
        self._answer_port = answer_port
        self._tell = tell
        self._clock = clock
        self._complained: set[str] = set()
        self._lock = threading.Lock()
        self._wishes: dict[str | int, Wish] = {}  # by action, of which only the newest counts,
        self._pressed = self._waiting = 0  # or by the number of the press
        self._audience: tuple[str, int] | None = None
        self._told: dict[str, float] = {}
        self._told_to: tuple[str, int] | None = None
        self._answered = self._told_all = -math.inf
        self._transport = UdpTransport(host, port, scheme="osc")
        self.host, self.port = self._transport.host, self._transport.port
        self._thread = threading.Thread(target=self._listen, name="remote", daemon=True)
        self._thread.start()

    def serve(self, desk: ShowControls) -> None:
        """Fulfil what was wished for since the last time, and tell how things are now."""
        for wish in self._next():
            action = ACTIONS[wish.action]
            try:
                if wish.value is None and action.press is not None:
                    action.press(desk)
                elif wish.value is not None and action.write is not None:
                    action.write(desk, wish.value)
            except InputError as error:
                self._complain(wish.action, str(error))
        self._answer(desk)

    def close(self) -> None:
        """Give the port back; may be called twice."""
        self._transport.close()
        self._thread.join(PATIENCE)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _listen(self) -> None:
        try:
            self._transport.run(self._deliver)
        except (InputError, OSError) as error:
            self._tell(f"the remote control has stopped: {error}")

    def _deliver(self, data: bytes, arrival: float, source: Hashable) -> None:
        del arrival
        try:
            messages = read_packet(data)
        except OscError:
            self.refused += 1
            return
        for message in messages:
            try:
                wish = wish_of(message)
            except WishError as error:
                self.refused += 1
                self._complain(message.address, str(error))
                continue
            self._heard(source)
            if wish is not None:
                self._keep(wish)

    def _keep(self, wish: Wish) -> None:
        with self._lock:
            if wish.value is not None:
                self._wishes.pop(wish.action, None)
                self._wishes[wish.action] = wish
            elif self._waiting < WAITING:
                self._wishes[self._pressed] = wish
                self._pressed += 1
                self._waiting += 1
            else:
                self.dropped += 1

    def _next(self) -> list[Wish]:
        """What is to be fulfilled now, in order: as far as the last of `AT_ONCE` presses."""
        wishes: list[Wish] = []
        presses = 0
        with self._lock:
            for key in list(self._wishes):
                presses += isinstance(key, int)
                if presses > AT_ONCE:
                    break
                wishes.append(self._wishes.pop(key))
                self._waiting -= isinstance(key, int)
        return wishes

    def _complain(self, address: str, reason: str) -> None:
        """Say once what is wrong with a wish, for whoever lays out a phone's buttons."""
        shown = ascii(address[:60])
        if len(self._complained) < MOST_COMPLAINTS and shown not in self._complained:
            self._complained.add(shown)
            self._tell(f"the remote control asked for {shown}: {reason}")

    def _heard(self, source: Hashable) -> None:
        """Remember who is to be answered: the last one to speak, if it is on this network."""
        match source:
            case (str(host), int(port)) if _is_near(host):
                self._audience = (host, self._answer_port or port)

    def _answer(self, desk: ShowControls) -> None:
        """Tell who spoke last what has changed, at most `ANSWERS` times a second."""
        now, audience = self._clock(), self._audience
        if audience is None or now - self._answered < 1.0 / ANSWERS:
            return
        state = {name: action.read(desk) for name, action in ACTIONS.items() if action.read}
        if audience == self._told_to and now - self._told_all < REPEATED:
            news = {name: value for name, value in state.items() if self._told[name] != value}
        else:
            news, self._told_all = state, now
        if not news:
            return
        messages = [write_message(STATE + name, "f", value) for name, value in news.items()]
        for bundle in write_bundles(messages, LONGEST):
            self._transport.send(bundle, audience)
        self._told, self._told_to, self._answered = state, audience, now


def _is_near(host: str) -> bool:
    """Whether an address is this machine's or of its own network; others are never answered."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return (address.is_loopback or address.is_private or address.is_link_local) and not (
        address.is_unspecified or address.is_multicast
    )
