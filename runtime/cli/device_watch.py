"""Listening at the addresses of devices for a while, for `bunraku devices`."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

import numpy as np

from devices.errors import InputError
from devices.stream import ADAPTERS, SkeletonStream, open_stream
from devices.transport.port_owner import Owner, port_owner
from devices.transport.traffic import Traffic
from runtime.output.files.whole_file import whole_file

PLACES = (
    "sim://",
    "vmc://127.0.0.1:39539",
    "vmc://127.0.0.1:39540?role=performer",
    "vrchat://127.0.0.1:9000",
    "nimate://127.0.0.1:7000",
    "nimate://127.0.0.1:7110",
    "nimate://127.0.0.1:11011",
    "rokoko://127.0.0.1:14043",
    "xsens://127.0.0.1:9763",
    "mediapipe://127.0.0.1:7005",
    "webcam://0",
    "kinect://v1",
    "kinect://v2",
    "kinect://azure",
    "leap://",
    "leap+ws://127.0.0.1:6437",
    "zmq+tcp://127.0.0.1:5570",
)
"""The usual address of each kind of device, with the ports that its senders use by default."""

LISTENS = ("vmc", "vrchat", "nimate", "rokoko", "xsens", "mediapipe")
"""The kinds of device that open a UDP port of this machine."""

POLL_STEP = 0.02  # [s] between two polls
WAKES = 0.1  # [s] at most until Ctrl-C is noticed


class State(StrEnum):
    """The state of an address."""

    ARRIVING = "arriving"
    UNCLEAR = "unclear"  # packets arrive, but they hold no frames
    SILENT = "silent"
    TAKEN = "taken"
    MISSING = "missing"
    READY = "ready"


@dataclass(slots=True)
class Watch:
    """One address and what arrived there.

    Attributes:
        address: as the user writes it.
        state, detail: the line to print.
        performers: the numbers of the performers whose frames arrived.
        joints: the most joints that one frame had seen.
        blends: the most blend shapes that one frame had.
        traffic: counts of packets and frames; None where nothing could be opened, or for a device
            that is no live stream.
        silence: [s] since the last packet.
        owner: the process that has the port.
    """

    address: str
    state: State = State.SILENT
    detail: str = ""
    performers: set[int] = field(default_factory=set)
    joints: int = 0
    blends: int = 0
    traffic: Traffic | None = None
    silence: float = float("nan")
    owner: Owner | None = None


def check_kind(address: str) -> None:
    """Refuse an address of no known kind.

    Raises:
        InputError: it is one; the message lists the known kinds.
    """
    try:
        scheme = urlsplit(address).scheme
    except ValueError as error:
        raise InputError(f"cannot open {address!r}: not an address ({error})") from error
    if scheme not in ADAPTERS:
        known = ", ".join(f"{kind}://" for kind in ADAPTERS)
        raise InputError(f"cannot open {address!r}: no such kind of device; there are: {known}")


def watch(
    addresses: Sequence[str], seconds: float, *, clock: Callable[[], float] = time.perf_counter
) -> list[Watch]:
    """Listen at all addresses at once for `seconds` [s] of a clock; results are in their order."""
    stop = threading.Event()
    with ThreadPoolExecutor(len(addresses)) as pool:
        try:
            watches = [pool.submit(_watch, address, seconds, stop, clock) for address in addresses]
            # A signal that comes just before a wait without end begins would not end it.
            while wait(watches, timeout=WAKES).not_done:
                pass
            return [one.result() for one in watches]
        finally:
            stop.set()  # Ctrl-C ends all of them


def _watch(
    address: str, seconds: float, stop: threading.Event, clock: Callable[[], float]
) -> Watch:
    seen = Watch(address)
    try:
        stream = open_stream(_for_a_look(urlsplit(address), seconds))
    except InputError as error:
        return _not_opened(seen, str(error))
    with stream:
        traffic = getattr(stream, "traffic", None)
        if traffic is None:
            seen.state, seen.detail = State.READY, "always there, 60 frames a second"
            return seen
        until = clock() + seconds  # opening takes time of its own
        while not stop.wait(min(POLL_STEP, max(until - clock(), 0.0))):
            _poll(seen, stream)
            if clock() >= until:
                break
        seen.traffic = stream.traffic  # type: ignore[attr-defined]  # a live stream has it
    return _described(seen, time.perf_counter(), seconds)


def _for_a_look(address: SplitResult, seconds: float) -> str:
    """The address, with an option that keeps opening short, unless the address has it.

    A bridge is waited for while others are listened to; a webcam fetches no models.
    """
    options = {"zmq+tcp": f"wait={seconds}", "webcam": "fetch=off"}
    option = options.get(address.scheme)
    if option is None or f"{option.partition('=')[0]}=" in address.query:
        return address.geturl()
    return f"{address.geturl()}{'&' if address.query else '?'}{option}"


def _poll(seen: Watch, stream: SkeletonStream) -> None:
    for frame in stream.poll():
        seen.performers.add(frame.performer)
        seen.joints = max(seen.joints, int(np.count_nonzero(frame.confidence)))
        seen.blends = max(seen.blends, len(frame.blends or ()))


def _not_opened(seen: Watch, reason: str) -> Watch:
    """The result for an address that cannot be opened: a taken port, or something missing."""
    address = urlsplit(seen.address)
    seen.state, seen.detail = State.MISSING, reason.partition(": ")[2] or reason
    port = port_of(seen.address)
    if address.scheme in LISTENS and port and f"{port} is taken" in reason:
        seen.state = State.TAKEN
        seen.owner = port_owner(port, "tcp" if "transport=tcp" in address.query else "udp")
    elif address.scheme == "zmq+tcp" and "no bridge answers" in reason:
        seen.state = State.SILENT
    return seen


def _described(seen: Watch, now: float, seconds: float) -> Watch:
    traffic = seen.traffic
    assert traffic is not None
    seen.silence = now - traffic.last_seen
    if traffic.frames:
        seen.state = State.ARRIVING
        people = len(seen.performers)
        seen.detail = (
            f"{traffic.rate / max(people, 1):.1f} Hz, jitter {1e3 * traffic.jitter:.1f} ms, "
            f"last seen {seen.silence:.1f} s ago, {people} performer{'s' * (people != 1)}, "
            f"{seen.joints} joints" + (f", {seen.blends} blend shapes" if seen.blends else "")
        )
    elif traffic.packets:
        seen.state = State.UNCLEAR
        seen.detail = (
            f"{traffic.packets} packets came, and none held a performer's frame; does the sender "
            f"speak {urlsplit(seen.address).scheme}?"
        )
    else:
        seen.detail = traffic.trouble or f"nothing came in {seconds:g} s"
    lost = {"refused": traffic.refused, "dropped": traffic.dropped}
    seen.detail += "".join(f", {count} {what}" for what, count in lost.items() if count)
    return seen


def listening_ports() -> list[int]:
    """The UDP ports of this machine that the addresses of `PLACES` open."""
    listening = [address for address in PLACES if urlsplit(address).scheme in LISTENS]
    return [port for address in listening if (port := port_of(address)) is not None]


def port_of(address: str) -> int | None:
    """The port of an address; None where it has none."""
    try:
        return urlsplit(address).port
    except ValueError:
        return None


def write_json(path: Path, seconds: float, watches: Sequence[Watch]) -> None:
    """Write the results of `watch` as JSON.

    Args:
        path: the file to write.
        seconds: how long [s] the addresses were listened to.
        watches: the results.

    Raises:
        InputError: the file cannot be written.
    """
    figures = {"seconds": seconds, "devices": [_figures(seen) for seen in watches]}
    with whole_file(path) as partial:
        text = json.dumps(figures, indent=2, allow_nan=False)
        partial.write_text(text + "\n", encoding="utf-8")


def _figures(seen: Watch) -> dict[str, Any]:
    figures: dict[str, Any] = {
        "address": seen.address,
        "kind": urlsplit(seen.address).scheme,
        "state": str(seen.state),
        "detail": seen.detail,
    }
    if seen.owner is not None:
        figures["owner"] = {"process": seen.owner.process, "name": seen.owner.name}
    if seen.traffic is not None:
        figures |= {
            "performers": sorted(seen.performers),
            "joints": seen.joints,
            "blends": seen.blends,
            "rate": seen.traffic.rate / max(len(seen.performers), 1),
            "jitter_ms": 1e3 * seen.traffic.jitter,
            "last_seen_s": seen.silence if np.isfinite(seen.silence) else None,
            "packets": seen.traffic.packets,
            "frames": seen.traffic.frames,
            "refused": seen.traffic.refused,
            "dropped": seen.traffic.dropped,
        }
    return figures
