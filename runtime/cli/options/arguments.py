"""Types of option values: each function takes the text of an option and returns its value.

Raises:
    argparse.ArgumentTypeError: the text is no such value; the message says what is expected.
"""

from __future__ import annotations

import argparse
import math
import re
import string

from runtime.control.flow_settings import MOST_COUNT_IN
from runtime.show.settings import LEAST_SIDE, MOST_SIDE, MOST_STIFFNESS, MOST_VOLUME_GAIN

MOST_SECONDS = 3600.0  # of a countdown
MOST_MOMENT = 1e6  # [s] of a session


class Once(argparse.Action):
    """Accepts an option only once; else the first of two values would be lost silently."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        """Set the value.

        Raises:
            ArgumentError: the option was given before.
        """
        if getattr(namespace, self.dest) is not self.default:
            raise argparse.ArgumentError(self, "is given twice; leave one out")
        setattr(namespace, self.dest, values)


def size(text: str) -> tuple[int, int]:
    """Width and height of a picture [px], from ``WxH``."""
    width, _, height = text.lower().partition("x")
    try:
        pair = int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected WIDTHxHEIGHT, as in 960x540, got {text!r}"
        ) from None
    if not all(LEAST_SIDE <= side <= MOST_SIDE for side in pair):
        raise argparse.ArgumentTypeError(
            f"each side must be {LEAST_SIDE} to {MOST_SIDE} pixels, got {text!r}"
        )
    return pair


def digits(text: str) -> str:
    """A PIN: 1 to 12 digits."""
    if not re.fullmatch(r"[0-9]{1,12}", text):
        raise argparse.ArgumentTypeError(f"expected 1 to 12 digits, got {text!r}")
    return text


def positive(text: str) -> float:
    """A finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number above 0, got {text!r}") from None
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected a finite number above 0, got {text!r}")
    return value


def seconds(text: str) -> float:
    """A finite number of seconds from 0."""
    return _between(text, 0.0, MOST_MOMENT)


def count_in(text: str) -> float:
    """A number of seconds of a count-in."""
    return _between(text, 0.0, MOST_COUNT_IN)


def seconds_or_never(text: str) -> float:
    """A number of seconds from 0, or "never" for infinity."""
    if text == "never":
        return math.inf
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= MOST_SECONDS:
        raise argparse.ArgumentTypeError(
            f"expected seconds from 0 to {MOST_SECONDS:.0f}, or never, got {text!r}"
        )
    return value


def counting(text: str) -> int:
    """A whole number from 1."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}") from None
    if not 1 <= value <= 1_000_000:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}")
    return value


def whole(text: str) -> int:
    """A whole number from 0."""
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise argparse.ArgumentTypeError(f"expected a whole number from 0, got {text!r}")
    return int(text)


def share(text: str) -> float:
    """A number from 0 to 1."""
    return _between(text, 0.0, 1.0)


def share_or_rigid(text: str) -> float | None:
    """A number from 1e-6 to 1, or "rigid" for None."""
    return None if text == "rigid" else _between(text, 1e-6, 1.0)


def stiffness(text: str) -> float:
    """A number from 0 to 0.99."""
    return _between(text, 0.0, MOST_STIFFNESS)


def gain(text: str) -> float:
    """A number from 0 to 10."""
    return _between(text, 0.0, MOST_VOLUME_GAIN)


def _between(text: str, least: float, most: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(
            f"expected a number from {least:g} to {most:g}, got {text!r}"
        )
    return value


def colour(text: str) -> tuple[int, int, int]:
    """Red, green and blue in sRGB bytes, from ``#rrggbb``, ``#rgb`` or ``chroma``."""
    if text.lower() == "chroma":
        return 0, 255, 0
    digits = text.removeprefix("#")
    if len(digits) == 3:
        digits = "".join(2 * digit for digit in digits)
    if len(digits) != 6 or not set(digits) <= set(string.hexdigits):
        raise argparse.ArgumentTypeError(f"expected chroma or a colour as in #203040, got {text!r}")
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue


def host_port(text: str) -> tuple[str, int | None]:
    """A host and a port from ``HOST:PORT``; None where there is no port."""
    host, colon, port = text.rpartition(":") if text.count(":") == 1 else (text, "", "")
    host = host.removeprefix("[").removesuffix("]")
    if not host or (colon and not (port.isdecimal() and 1 <= int(port) <= 65535)):
        raise argparse.ArgumentTypeError(f"expected HOST:PORT, as in 127.0.0.1:39539, got {text!r}")
    return host, int(port) if colon else None


def remote_address(text: str) -> tuple[str, int | None]:
    """A host and a port, as of `host_port`; ``osc://`` may stand before them."""
    return host_port(text.removeprefix("osc://"))


def port_number(text: str) -> int:
    """A port from 1 to 65535."""
    if not (text.isascii() and text.isdecimal() and 1 <= int(text[:6]) <= 65535):
        raise argparse.ArgumentTypeError(f"expected a port from 1 to 65535, got {text!r}")
    return int(text)
