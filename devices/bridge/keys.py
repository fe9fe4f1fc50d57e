"""CURVE keys of the bridge: one folder per machine, and the rule for when keys are required.

The folder of the capture machine holds the publisher's key pair and, in ``allowed``, the public
keys of the subscribers. The folder of the show's machine holds the subscriber's pair and the
publisher's public key. The files are ZeroMQ certificates. Source: https://rfc.zeromq.org/spec/25
(ZMTP CURVE) and /26 (CurveZMQ).
"""

from __future__ import annotations

import ipaddress
import os
import stat
import struct
from dataclasses import dataclass
from pathlib import Path

import zmq
import zmq.auth
from zmq.utils import z85

from devices.errors import InputError

PUBLISHER, SUBSCRIBER = "capture", "stage"  # names of the two folders
_PUBLIC, _SECRET = ".key", ".key_secret"
_BRIDGE, _ALLOWED = "bridge", "allowed"
_MAX_ALLOWED = 256


@dataclass(frozen=True, slots=True)
class PublisherKeys:
    """The publisher's pair and the allowed subscribers; all as 40 characters of Z85."""

    public: bytes
    secret: bytes
    allowed: frozenset[bytes]


@dataclass(frozen=True, slots=True)
class SubscriberKeys:
    """A subscriber's pair and the publisher that it trusts; all as 40 characters of Z85."""

    public: bytes
    secret: bytes
    bridge: bytes


def make_keys(folder: Path) -> None:
    """Write new pairs: one folder for the capture machine, one for the show's machine.

    Only the owner can read the files and folders, from the moment of their creation.

    Raises:
        InputError: keys exist already, or the folder cannot be written.
    """
    publisher, subscriber = folder / PUBLISHER, folder / SUBSCRIBER
    for made in (publisher, subscriber):
        if made.exists():
            raise InputError(f"{made} exists already; give another folder, keys are not replaced")
    publisher_pair, subscriber_pair = zmq.curve_keypair(), zmq.curve_keypair()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for made in (publisher, subscriber, publisher / _ALLOWED):
            made.mkdir(mode=0o700)
        _write(publisher / f"{_BRIDGE}{_SECRET}", *publisher_pair)
        _write(publisher / _ALLOWED / f"{SUBSCRIBER}{_PUBLIC}", subscriber_pair[0])
        _write(subscriber / f"{SUBSCRIBER}{_SECRET}", *subscriber_pair)
        _write(subscriber / f"{_BRIDGE}{_PUBLIC}", publisher_pair[0])
    except OSError as error:
        raise InputError(f"cannot write keys to {folder}: {error.strerror or error}") from error


def read_publisher_keys(folder: Path) -> PublisherKeys:
    """Read the keys of the capture machine.

    Raises:
        InputError: the keys are missing, damaged, or readable by other users.
    """
    public, secret = _read_pair(folder / f"{_BRIDGE}{_SECRET}")
    allowed = sorted((folder / _ALLOWED).glob(f"*{_PUBLIC}"))[:_MAX_ALLOWED]
    if not allowed:
        raise InputError(
            f"{folder / _ALLOWED} holds no public key, so no show could connect; copy one there"
        )
    return PublisherKeys(public, secret, frozenset(_read(path)[0] for path in allowed))


def read_subscriber_keys(folder: Path) -> SubscriberKeys:
    """Read the keys of the show's machine.

    Raises:
        InputError: the keys are missing, damaged, or readable by other users.
    """
    public, secret = _read_pair(folder / f"{SUBSCRIBER}{_SECRET}")
    return SubscriberKeys(public, secret, _read(folder / f"{_BRIDGE}{_PUBLIC}")[0])


def is_loopback(host: str) -> bool:
    """Whether a host name or address refers to this machine only, as ``localhost`` does."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def check_guarded(host: str, *, keys: Path | None, option: str) -> None:
    """Check that traffic that leaves this machine is encrypted.

    Raises:
        InputError: `host` is not this machine and there are no keys; `option` is the option of the
            command line that takes them.
    """
    if keys is None and not is_loopback(host):
        raise InputError(
            f"{host or '*'} is beyond this machine, where others could listen: make keys with "
            f"`bunraku bridge --make-keys DIR` and give {option}"
        )


def _write(path: Path, public: bytes, secret: bytes | None = None) -> None:
    """Write a certificate that `zmq.auth` can read; its own function makes it world-readable."""
    lines = ["metadata", "curve", f'    public-key = "{public.decode()}"']
    if secret is not None:
        lines.append(f'    secret-key = "{secret.decode()}"')
    opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(opened, "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")


def _read_pair(path: Path) -> tuple[bytes, bytes]:
    if os.name == "posix" and path.exists() and path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(f"{path} can be read by other users; restrict it with `chmod 600` first")
    public, secret = _read(path)
    if secret is None:
        raise InputError(f"{path} holds no secret key; copy it again from where it was made")
    return public, secret


def _read(path: Path) -> tuple[bytes, bytes | None]:
    try:
        if path.stat().st_size > 1 << 16:
            raise ValueError
        public, secret = zmq.auth.load_certificate(path)
        for key in (public, secret):
            if key is not None and len(z85.decode(key)) != 32:
                raise ValueError
    except FileNotFoundError as error:
        raise InputError(
            f"{path} is missing; `bunraku bridge --make-keys DIR` makes the folders "
            f"DIR/{PUBLISHER} (for the bridge) and DIR/{SUBSCRIBER} (for the show's machine)"
        ) from error
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise InputError(f"{path} is not a key; copy it again from where it was made") from error
    return public, secret
