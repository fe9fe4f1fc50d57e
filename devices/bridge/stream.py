"""Device ``zmq+tcp://HOST:PORT``: frames that `bunraku bridge` publishes on another machine.

Options: ``mode=latest`` (a frame is skipped when a newer one of its performer exists) or
``mode=lossless`` (every frame, in order); ``keys=DIR`` for any address beyond this machine;
``wait=SECONDS`` for the publisher at the start.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self
from urllib.parse import SplitResult

import zmq

from devices.address import host_and_port, one_of, options_of, positive
from devices.bridge.frame_queues import AllFrames, FrameQueue, LatestFrames
from devices.bridge.keys import SubscriberKeys, check_guarded, read_subscriber_keys
from devices.bridge.messages import LATEST, MAX_CREDIT, MODES, VERSION
from devices.bridge.receiver import BridgeReceiver
from devices.bridge.socket import Context, Handshake, Handshakes, bridge_socket, tcp_endpoint
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.traffic import Rhythm, Traffic

PORT = 5570
PATIENCE = 10.0  # [s] for the publisher to answer at the start
SILENT = 2.0  # [s] without an answer, after which the publisher counts as absent
GLANCE = 20  # [ms] between checks of the queue and of the closing flag
AT_ONCE = 256  # messages after which the reader pauses for as long as it has worked


@dataclass(frozen=True, slots=True)
class Bridge:
    """Address and settings of a connection to a publisher.

    Attributes:
        endpoint: in ZeroMQ's notation.
        mode: `LATEST` or `LOSSLESS`.
        keys: for CURVE, or None on this machine.
        patience: time [s] to wait for the first answer.
    """

    endpoint: str
    mode: int = LATEST
    keys: SubscriberKeys | None = None
    patience: float = PATIENCE


class BridgeStream:
    """A `SkeletonStream` over a bridge; one thread exchanges messages and stamps arrivals.

    It reconnects when the publisher returns, or when another one takes its place.

    Args:
        bridge: address and settings.
        clock: host monotonic time [s].

    Raises:
        InputError: no publisher answers in time, it refuses our key, or its version differs.
    """

    def __init__(self, bridge: Bridge, clock: Callable[[], float] = time.perf_counter) -> None:
        self._bridge = bridge
        self._clock = clock
        self._receiver = BridgeReceiver(bridge.mode)
        self._inbox: FrameQueue = (
            LatestFrames() if bridge.mode == LATEST else AllFrames(2 * MAX_CREDIT)
        )
        self._listeners: tuple[Callable[[SkeletonFrame], None], ...] = ()
        self._rhythm = Rhythm()
        self._packets = self._frames = 0
        self._last_seen = float("nan")
        self._handshake = Handshake.DONE
        self._closing = threading.Event()
        self._decided = threading.Event()  # the skeleton has come, or a reason why it will not
        self._context: Context = zmq.Context()
        self._socket = bridge_socket(self._context, zmq.DEALER, bridge.endpoint, bridge.keys)
        self._handshakes = Handshakes(self._socket)
        try:
            self._socket.connect(bridge.endpoint)
        except zmq.ZMQError as error:
            self._release()
            raise InputError(f"cannot open {bridge.endpoint}: {error.strerror}") from error
        self._thread = threading.Thread(target=self._run, name="bridge", daemon=True)
        self._thread.start()
        self._wait_for_skeleton()

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton that the publisher announced first."""
        if self._receiver.skeleton is None:
            raise InputError(self._trouble())
        return self._receiver.skeleton

    @property
    def ended(self) -> bool:
        """True only once it is closed."""
        return self._closing.is_set()

    @property
    def traffic(self) -> Traffic:
        """Counters of the received data; `dropped` includes frames skipped by the publisher."""
        rate, jitter = self._rhythm.measure(self._clock())
        return Traffic(
            packets=self._packets,
            frames=self._frames,
            refused=self._receiver.refused,
            dropped=self._inbox.dropped + self._receiver.lost,
            rate=rate,
            jitter=jitter,
            last_seen=self._last_seen,
            trouble=self._trouble(),
        )

    def tap(self, listener: Callable[[SkeletonFrame], None]) -> None:
        """Pass every frame from now on to `listener`, in order, on the bridge's thread.

        The listener must not wait or raise.
        """
        self._listeners = (*self._listeners, listener)

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return the frames since the last poll, oldest first; never blocks."""
        return [] if self.ended else self._inbox.take()

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` for a frame; return whether there is one."""
        return self._inbox.wait(seconds)

    def close(self) -> None:
        """Disconnect; may be called twice."""
        if not self._closing.is_set():
            self._closing.set()
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _wait_for_skeleton(self) -> None:
        try:
            self._decided.wait(self._bridge.patience)
            if self._receiver.skeleton is None:
                raise InputError(f"cannot open {self._bridge.endpoint}: {self._trouble()}")
        except BaseException:  # Ctrl-C as well
            self.close()
            raise

    def _trouble(self) -> str:
        """One line that describes the current fault, or an empty one."""
        receiver, now = self._receiver, self._clock()
        if self._handshake is Handshake.KEY_REFUSED:
            return "the bridge refused our key; its folder `allowed` must hold our public key"
        if receiver.other_version is not None:
            return (
                f"the bridge speaks version {receiver.other_version} and we speak {VERSION}; "
                "install the same bunraku on both machines"
            )
        if receiver.strange:
            return "the bridge sends another skeleton than before; start the show again"
        if now - receiver.heard_at <= SILENT:
            return ""
        if self._handshake is Handshake.FAILED:
            return f"no connection to the bridge: {self._handshake.value}"
        return "no bridge answers; is `bunraku bridge` running there, at this address?"

    def _run(self) -> None:
        """Send calls and receive messages until closed, on a thread of its own."""
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        poller.register(self._handshakes.monitor, zmq.POLLIN)
        try:
            while not self._closing.is_set():
                self._call()
                found = dict(poller.poll(GLANCE))
                if self._handshakes.monitor in found:
                    self._shake_hands()
                if self._socket in found:
                    self._receive()
            self._send(self._receiver.farewell(self._clock()))
        finally:
            self._release()

    def _call(self) -> None:
        now, waiting = self._clock(), self._inbox.waiting
        if self._receiver.call_due(now, waiting):
            self._send(self._receiver.call(now, waiting))

    def _send(self, data: bytes) -> None:
        with suppress(zmq.Again):  # no connection now; the next call will do
            self._socket.send(data, zmq.NOBLOCK)

    def _receive(self) -> None:
        began = self._clock()
        for _ in range(AT_ONCE):
            try:
                data = self._socket.recv(zmq.NOBLOCK)
            except zmq.Again:
                return
            self._take_in(data, self._clock())
            self._call()
        # More messages than a publisher should send: yield time to the rest of the program.
        self._closing.wait(self._clock() - began)

    def _take_in(self, data: bytes, arrival: float) -> None:
        self._packets += 1
        self._last_seen = arrival
        frames = self._receiver.feed(data, arrival)
        for frame in frames:
            self._rhythm.note(arrival, frame.performer)
            for listener in self._listeners:
                listener(frame)
        self._frames += len(frames)
        if not self._decided.is_set():
            self._decide()
        self._inbox.put(frames)  # last: the woken thread needs the interpreter that this one holds

    def _decide(self) -> None:
        """Wake the opening thread once there is a skeleton or a version mismatch."""
        if self._receiver.skeleton is not None or self._receiver.other_version is not None:
            self._decided.set()

    def _shake_hands(self) -> None:
        for outcome in self._handshakes.news():
            self._handshake = outcome
            if outcome is Handshake.KEY_REFUSED:
                self._decided.set()
                # ZeroMQ stops trying such a publisher; another that accepts our key may follow.
                self._socket.disconnect(self._bridge.endpoint)
                self._closing.wait(SILENT)
                self._socket.connect(self._bridge.endpoint)

    def _release(self) -> None:
        self._handshakes.close()
        self._socket.close()
        self._context.term()


def open_device(address: SplitResult) -> BridgeStream:
    """Open ``zmq+tcp://HOST:PORT``."""
    host, port = host_and_port(address, PORT)
    if port == 0:
        raise InputError(f"cannot open {address.geturl()!r}: give the port that the bridge prints")
    options = options_of(address, {"mode": one_of(*MODES), "keys": Path, "wait": positive})
    keys: Path | None = options.get("keys")
    check_guarded(host, keys=keys, option=f"`?keys=DIR/stage` in {address.geturl()}")
    return BridgeStream(
        Bridge(
            endpoint=tcp_endpoint(host, port),
            mode=MODES[options.get("mode", "latest")],
            keys=None if keys is None else read_subscriber_keys(keys),
            patience=options.get("wait", PATIENCE),
        )
    )
