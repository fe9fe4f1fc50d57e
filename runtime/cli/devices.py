"""`bunraku devices`: what is connected, what arrives, and why nothing does."""

from __future__ import annotations

import argparse
import json
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

import numpy as np

from devices.errors import InputError
from devices.stream import ADAPTERS, SkeletonStream, open_stream
from devices.transport.port_owner import Owner, port_owner
from devices.transport.traffic import Traffic
from replay.formats import formats
from runtime.characters.builtin import BUILTIN
from runtime.output.files.whole_file import check_writable, whole_file

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
    "mediapipe://webcam",
    "kinect://v1",
    "kinect://v2",
    "kinect://azure",
    "leap://",
    "leap+ws://127.0.0.1:6437",
    "zmq+tcp://127.0.0.1:5570",
)
"""Where each kind of device is looked for; the ports are those that its senders use by default."""

LISTENS = ("vmc", "vrchat", "nimate", "rokoko", "xsens", "mediapipe")
"""Kinds that open a UDP port of this machine."""

SECONDS = 2.0
GLANCE = 0.02  # [s] between two looks at what has come


class State(StrEnum):
    """What can be said of a place."""

    ARRIVING = "arriving"
    UNCLEAR = "unclear"  # packets come, but no frames can be made of them
    SILENT = "silent"
    TAKEN = "taken"
    MISSING = "missing"
    READY = "ready"


@dataclass(slots=True)
class Watch:
    """One place while it is listened to, and what was seen there.

    Attributes:
        address: as the user writes it.
        state, detail: what to tell.
        performers: whose frames came.
        joints: how many joints were seen in one frame, at most.
        traffic: what came, None where nothing could be opened or it is no live stream.
        silence: [s] since the last packet.
        owner: who has the port.
    """

    address: str
    state: State = State.SILENT
    detail: str = ""
    performers: set[int] = field(default_factory=set)
    joints: int = 0
    traffic: Traffic | None = None
    silence: float = float("nan")
    owner: Owner | None = None


def devices(options: argparse.Namespace) -> int:
    """Listen at every place, or at those that are named, and print what is there.

    Raises:
        InputError: an address is of no known kind, or the file cannot be written.
    """
    if options.json is not None:
        check_writable(options.json)
    for address in options.addresses:
        _check_kind(address)
    seconds: float = options.seconds
    watches = watch(options.addresses or PLACES, seconds)
    width = max(len(seen.address) for seen in watches)
    for seen in watches:
        print(f"{seen.state:<10} {seen.address:<{width}}  {seen.detail}")
    if not options.addresses:
        print("recordings " + ", ".join(kind.name for kind in formats()))
        print("characters " + ", ".join(BUILTIN))
    if options.json is not None:
        _write(options.json, seconds, watches)
    return 0


def _check_kind(address: str) -> None:
    try:
        scheme = urlsplit(address).scheme
    except ValueError as error:
        raise InputError(f"cannot open {address!r}: not an address ({error})") from error
    if scheme not in ADAPTERS:
        known = ", ".join(f"{kind}://" for kind in ADAPTERS)
        raise InputError(f"cannot open {address!r}: no such kind of device; there are: {known}")


def watch(addresses: Sequence[str], seconds: float) -> list[Watch]:
    """Listen at all addresses at once for so long [s]; what was seen at each, in their order."""
    stop = threading.Event()
    with ThreadPoolExecutor(len(addresses)) as pool:
        try:
            waiting = [pool.submit(_watch, address, seconds, stop) for address in addresses]
            return [one.result() for one in waiting]
        finally:
            stop.set()  # Ctrl-C ends all of them


def _watch(address: str, seconds: float, stop: threading.Event) -> Watch:
    seen = Watch(address)
    try:
        stream = open_stream(_patient(urlsplit(address), seconds))
    except InputError as error:
        return _closed(seen, str(error))
    with stream:
        traffic = getattr(stream, "traffic", None)
        if traffic is None:
            seen.state, seen.detail = State.READY, "always there, 60 frames a second"
            return seen
        until = time.perf_counter() + seconds  # opening has its own time
        while not stop.wait(min(GLANCE, max(until - time.perf_counter(), 0.0))):
            _look(seen, stream)
            if time.perf_counter() >= until:
                break
        seen.traffic = stream.traffic  # type: ignore[attr-defined]  # a live stream has it
    return _told(seen, time.perf_counter(), seconds)


def _patient(address: SplitResult, seconds: float) -> str:
    """The address, and how long to wait for a bridge where it does not say."""
    if address.scheme == "zmq+tcp" and "wait=" not in address.query:
        return f"{address.geturl()}{'&' if address.query else '?'}wait={seconds}"
    return address.geturl()


def _look(seen: Watch, stream: SkeletonStream) -> None:
    for frame in stream.poll():
        seen.performers.add(frame.performer)
        seen.joints = max(seen.joints, int(np.count_nonzero(frame.confidence)))


def _closed(seen: Watch, reason: str) -> Watch:
    """What could not be opened: its port is taken, or something is missing."""
    address = urlsplit(seen.address)
    seen.state, seen.detail = State.MISSING, reason.partition(": ")[2] or reason
    port = port_of(seen.address)
    if address.scheme in LISTENS and port and f"{port} is taken" in reason:
        seen.state = State.TAKEN
        seen.owner = port_owner(port, "tcp" if "transport=tcp" in address.query else "udp")
    elif address.netloc == "webcam" and find_spec("mediapipe") is None:
        seen.detail = "a webcam needs the extra: pip install 'bunraku[mediapipe]'"
    elif address.scheme == "zmq+tcp" and "no bridge answers" in reason:
        seen.state = State.SILENT
    return seen


def _told(seen: Watch, now: float, seconds: float) -> Watch:
    traffic = seen.traffic
    assert traffic is not None
    seen.silence = now - traffic.last_seen
    if traffic.frames:
        seen.state = State.ARRIVING
        people = len(seen.performers)
        seen.detail = (
            f"{traffic.rate / max(people, 1):.1f} Hz, jitter {1e3 * traffic.jitter:.1f} ms, "
            f"last seen {seen.silence:.1f} s ago, {people} performer{'s' * (people != 1)}, "
            f"{seen.joints} joints"
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
    """The UDP ports of this machine that the places in `PLACES` open."""
    listening = [address for address in PLACES if urlsplit(address).scheme in LISTENS]
    return [port for address in listening if (port := port_of(address)) is not None]


def port_of(address: str) -> int | None:
    """The port that an address names; None where it names none."""
    try:
        return urlsplit(address).port
    except ValueError:
        return None


def _write(path: Path, seconds: float, watches: Sequence[Watch]) -> None:
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
            "rate": seen.traffic.rate / max(len(seen.performers), 1),
            "jitter_ms": 1e3 * seen.traffic.jitter,
            "last_seen_s": seen.silence if np.isfinite(seen.silence) else None,
            "packets": seen.traffic.packets,
            "frames": seen.traffic.frames,
            "refused": seen.traffic.refused,
            "dropped": seen.traffic.dropped,
        }
    return figures
