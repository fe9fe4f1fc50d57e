"""The OSC remote: a phone, a foot pedal or another program runs the show over UDP.

``/bunraku/ACTION`` presses an action of `runtime.control.actions`: without an argument or with 1 it
is done, with 0, which buttons send when they are let go, it is not. A fader is set by its value in
[0, 1], a switch by ``/bunraku/ACTION/set``. The last sender receives the state of all actions as
``/bunraku/state/ACTION``, so that its lights and faders follow.
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
from runtime.control.actions import ACTIONS, press, set_value
from runtime.control.show_controls import ShowControls

PORT = 9100
ROOT = "/bunraku/"
STATE = ROOT + "state/"
SET = "/set"
WAITING = 64  # most presses that wait for a tick
AT_ONCE = 8  # most presses that one tick does, so that a flood does not delay the show
ANSWERS = 10.0  # most answers a second
REPEATED = 1.0  # [s] after which the whole state is sent again, since datagrams get lost
LONGEST = 1472  # bytes of a bundle in an Ethernet packet
MOST_WARNINGS = 8
PATIENCE = 2.0  # [s] that `close` waits for the reader thread


@dataclass(frozen=True, slots=True)
class Request:
    """One action that a message asks for.

    Attributes:
        action: its name.
        value: the value to set, in [0, 1]; None for a press.
    """

    action: str
    value: float | None = None


class RequestError(ValueError):
    """A message that names no action, or gives no value for one."""


def request_of(message: Message) -> Request | None:
    """Return the request of a message; None for a button that is let go.

    Raises:
        RequestError: no action has this address, or its value is missing or not a number.
    """
    name = message.address.removeprefix(ROOT)
    sets = name.endswith(SET)
    name = name.removesuffix(SET)
    action = ACTIONS.get(name)
    if action is None or not message.address.startswith(ROOT) or (sets and action.write is None):
        raise RequestError("there is no such action, see docs/remote.md")
    value = _value(message.arguments)
    if sets or action.press is None:
        if value is None:
            raise RequestError("it needs a value from 0 to 1")
        return Request(name, min(max(value, 0.0), 1.0))
    return Request(name) if value is None or value >= 0.5 else None


def _value(arguments: tuple[Argument, ...]) -> float | None:
    """Return the one number among the arguments; None where there are none.

    Raises:
        RequestError: the arguments are not one number.
    """
    if not arguments:
        return None
    (first, *more) = arguments
    if more or not isinstance(first, int | float) or math.isnan(first):
        raise RequestError("its value is not one number")
    return float(first)


class Remote:
    """Receives requests on a thread of its own; the frame loop's thread does them.

    Args:
        host, port: the address to listen on; port 0 takes any free one.
        answer_port: the port that senders listen on; 0 for the port that they send from.
        tell: takes one line on a message that was refused.
        clock: host monotonic time [s].

    Attributes:
        host, port: the address that it listens on.
        refused: messages that were not understood.
        dropped: presses that came faster than ticks could do them.

    Raises:
        InputError: the port cannot be opened; the message says why.
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
        self._warned: set[str] = set()
        self._lock = threading.Lock()
        # Values by the name of their action, so that only the newest counts; presses by number.
        self._requests: dict[str | int, Request] = {}
        self._pressed = self._waiting = 0
        self._sender: tuple[str, int] | None = None
        self._sent: dict[str, float] = {}
        self._sent_to: tuple[str, int] | None = None
        self._answered = self._all_sent = -math.inf
        self._transport = UdpTransport(host, port, scheme="osc")
        self.host, self.port = self._transport.host, self._transport.port
        self._thread = threading.Thread(target=self._listen, name="remote", daemon=True)
        self._thread.start()

    def serve(self, controls: ShowControls) -> None:
        """Do the requests since the last call, and answer with the state of all actions."""
        for request in self._next():
            try:
                if request.value is None:
                    press(request.action, controls)
                else:
                    set_value(request.action, request.value, controls)
            except InputError as error:
                self._warn(request.action, str(error))
        self._answer(controls)

    def close(self) -> None:
        """Close the port; may be called twice."""
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
                request = request_of(message)
            except RequestError as error:
                self.refused += 1
                self._warn(message.address, str(error))
                continue
            self._note_sender(source)
            if request is not None:
                self._keep(request)

    def _keep(self, request: Request) -> None:
        with self._lock:
            if request.value is not None:
                self._requests.pop(request.action, None)
                self._requests[request.action] = request
            elif self._waiting < WAITING:
                self._requests[self._pressed] = request
                self._pressed += 1
                self._waiting += 1
            else:
                self.dropped += 1

    def _next(self) -> list[Request]:
        """Take the requests to do now, in order: up to the last of `AT_ONCE` presses."""
        requests: list[Request] = []
        presses = 0
        with self._lock:
            for key in list(self._requests):
                presses += isinstance(key, int)
                if presses > AT_ONCE:
                    break
                requests.append(self._requests.pop(key))
                self._waiting -= isinstance(key, int)
        return requests

    def _warn(self, address: str, reason: str) -> None:
        """Report once for each address what is wrong with its messages."""
        shown = ascii(address[:60])
        if len(self._warned) < MOST_WARNINGS and shown not in self._warned:
            self._warned.add(shown)
            self._tell(f"the remote control asked for {shown}: {reason}")

    def _note_sender(self, source: Hashable) -> None:
        """Answer this sender from now on, if it is on this network."""
        match source:
            case (str(host), int(port)) if _is_near(host):
                self._sender = (host, self._answer_port or port)

    def _answer(self, controls: ShowControls) -> None:
        """Send the last sender what has changed, at most `ANSWERS` times a second."""
        now, sender = self._clock(), self._sender
        if sender is None or now - self._answered < 1.0 / ANSWERS:
            return
        state = {name: action.read(controls) for name, action in ACTIONS.items() if action.read}
        if sender == self._sent_to and now - self._all_sent < REPEATED:
            changed = {name: value for name, value in state.items() if self._sent[name] != value}
        else:
            changed, self._all_sent = state, now
        if not changed:
            return
        messages = [write_message(STATE + name, "f", value) for name, value in changed.items()]
        for bundle in write_bundles(messages, LONGEST):
            self._transport.send(bundle, sender)
        self._sent, self._sent_to, self._answered = state, sender, now


def _is_near(host: str) -> bool:
    """Whether an address belongs to this machine or a private network; others get no answer."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return (address.is_loopback or address.is_private or address.is_link_local) and not (
        address.is_unspecified or address.is_multicast
    )
