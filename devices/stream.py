"""The interface of every source of motion, and the door that opens one by its address."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, Self
from urllib.parse import SplitResult, urlsplit

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame


class SkeletonStream(Protocol):
    """A source of skeleton frames, live or recorded; the frame loop cannot tell them apart."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame of this stream."""
        ...

    @property
    def ended(self) -> bool:
        """True once no frame can come any more; a live source never ends by itself."""
        ...

    def poll(self) -> Sequence[SkeletonFrame]:
        """Every frame that has come since the last poll, oldest first; never blocks."""
        ...

    def close(self) -> None:
        """Release the device or file; may be called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


Opener = Callable[[SplitResult], SkeletonStream]

_openers: dict[str, Opener] = {}


def register_scheme(scheme: str, opener: Opener) -> None:
    """Let `open_stream` open addresses ``scheme://...`` with `opener`, given the split address."""
    _openers[scheme] = opener


def schemes() -> tuple[str, ...]:
    """Kinds of address that `open_stream` can open."""
    return tuple(sorted(_openers))


def open_stream(url: str) -> SkeletonStream:
    """Open the source of motion at `url`, e.g. ``sim://walk`` or ``vmc://127.0.0.1:39539``.

    Raises:
        InputError: the scheme is unknown (the message lists the known ones), or the device cannot
            be opened.
    """
    address = urlsplit(url)
    if address.scheme not in _openers:
        known = ", ".join(f"{scheme}://" for scheme in sorted(_openers))
        raise InputError(
            f"cannot open {url!r}: no such kind of device; there are: {known or 'none'}"
        )
    return _openers[address.scheme](address)
