"""The interface of every source of skeleton frames, and the function that opens one by address."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Protocol, Self
from urllib.parse import urlsplit

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame


class SkeletonStream(Protocol):
    """A source of skeleton frames, live or recorded, with the same interface."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame of this stream."""
        ...

    @property
    def ended(self) -> bool:
        """True once no further frame can come; of live sources only a film ends by itself."""
        ...

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return every frame that came since the last poll, oldest first; never blocks."""
        ...

    def close(self) -> None:
        """Release the device or file; may be called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


ADAPTERS = {
    "sim": "devices.builtin.simulator",
    "vmc": "devices.osc.vmc",
    "vrchat": "devices.osc.vrchat",
    "nimate": "devices.osc.nimate",
    "rokoko": "devices.suits.rokoko",
    "xsens": "devices.suits.xsens",
    "kinect": "devices.kinect.stream",
    "leap": "devices.leap.sdk",
    "leap+ws": "devices.leap.websocket",
    "mediapipe": "devices.mediapipe.stream",
    "webcam": "devices.webcam.stream",
    "zmq+tcp": "devices.bridge.stream",
}
"""The module of each address scheme. Each module has `open_device(address: SplitResult)`. It is
imported only when such an address is opened, so a missing SDK affects no other device."""


def open_stream(url: str) -> SkeletonStream:
    """Open the source at `url`, e.g. ``sim://walk`` or ``vmc://127.0.0.1:39539``.

    Raises:
        InputError: the scheme is unknown (the message lists the known ones), or the device cannot
            be opened.
    """
    try:
        address = urlsplit(url)
    except ValueError as error:
        raise InputError(f"cannot open {url!r}: not an address ({error})") from error
    if address.scheme not in ADAPTERS:
        known = ", ".join(f"{scheme}://" for scheme in ADAPTERS)
        raise InputError(f"cannot open {url!r}: no such kind of device; known kinds: {known}")
    stream: SkeletonStream = import_module(ADAPTERS[address.scheme]).open_device(address)
    return stream
