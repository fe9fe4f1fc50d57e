"""Who may cross a bridge: CURVE keys, one folder for each machine, and where none are needed.

A folder for the capture machine holds the bridge's own pair and, in ``allowed``, the public keys of
the stages; one for the stage machine holds the stage's own pair and the bridge's public key. Files
are ZeroMQ certificates, as other programs read them. Source: https://rfc.zeromq.org/spec/25 (ZMTP
CURVE) and /26 (CurveZMQ).
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

CAPTURE, STAGE = "capture", "stage"
_PUBLIC, _SECRET = ".key", ".key_secret"
_BRIDGE, _ALLOWED = "bridge", "allowed"
_MAX_ALLOWED = 256


@dataclass(frozen=True, slots=True)
class PublisherKeys:
    """The bridge's pair, and the stages that it lets in; all as 40 characters of Z85."""

    public: bytes
    secret: bytes
    allowed: frozenset[bytes]


@dataclass(frozen=True, slots=True)
class SubscriberKeys:
    """A stage's pair, and the bridge that it trusts; all as 40 characters of Z85."""

    public: bytes
    secret: bytes
    bridge: bytes


def make_keys(folder: Path) -> None:
    """Write new pairs: one folder for the capture machine, one for the stage machine.

    Every file and folder can be read by its owner only, from the moment it is there.

    Raises:
        InputError: there are keys already, or the folder cannot be written.
    """
    capture, stage = folder / CAPTURE, folder / STAGE
    for made in (capture, stage):
        if made.exists():
            raise InputError(f"{made} is there already; give another folder, no key is replaced")
    bridge_pair, stage_pair = zmq.curve_keypair(), zmq.curve_keypair()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for made in (capture, stage, capture / _ALLOWED):
            made.mkdir(mode=0o700)
        _write(capture / f"{_BRIDGE}{_SECRET}", *bridge_pair)
        _write(capture / _ALLOWED / f"{STAGE}{_PUBLIC}", stage_pair[0])
        _write(stage / f"{STAGE}{_SECRET}", *stage_pair)
        _write(stage / f"{_BRIDGE}{_PUBLIC}", bridge_pair[0])
    except OSError as error:
        raise InputError(f"cannot write keys to {folder}: {error.strerror or error}") from error


def read_publisher_keys(folder: Path) -> PublisherKeys:
    """The keys of the capture machine.

    Raises:
        InputError: they are not there, damaged, or can be read by others.
    """
    public, secret = _read_pair(folder / f"{_BRIDGE}{_SECRET}")
    allowed = sorted((folder / _ALLOWED).glob(f"*{_PUBLIC}"))[:_MAX_ALLOWED]
    if not allowed:
        raise InputError(f"{folder / _ALLOWED} holds no stage's public key, so none could come in")
    return PublisherKeys(public, secret, frozenset(_read(path)[0] for path in allowed))


def read_subscriber_keys(folder: Path) -> SubscriberKeys:
    """The keys of the stage machine.

    Raises:
        InputError: they are not there, damaged, or can be read by others.
    """
    public, secret = _read_pair(folder / f"{STAGE}{_SECRET}")
    return SubscriberKeys(public, secret, _read(folder / f"{_BRIDGE}{_PUBLIC}")[0])


def is_loopback(host: str) -> bool:
    """Whether only this machine can be behind a host name or address, as ``localhost`` is."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def check_guarded(host: str, *, keys: Path | None, option: str) -> None:
    """Make sure that what leaves this machine is guarded by keys.

    Raises:
        InputError: `host` is beyond this machine and there are no keys; `option` says where the
            command line takes them.
    """
    if keys is None and not is_loopback(host):
        raise InputError(
            f"{host or '*'} is beyond this machine, where anybody could listen: make keys with "
            f"`bunraku bridge --make-keys DIR` and give {option}"
        )


def _write(path: Path, public: bytes, secret: bytes | None = None) -> None:
    """A certificate as `zmq.auth` reads it, which would write one that all can read."""
    lines = ["metadata", "curve", f'    public-key = "{public.decode()}"']
    if secret is not None:
        lines.append(f'    secret-key = "{secret.decode()}"')
    opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(opened, "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")


def _read_pair(path: Path) -> tuple[bytes, bytes]:
    if os.name == "posix" and path.exists() and path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(
            f"{path} can be read by others: keep it to yourself with `chmod 600` first"
        )
    public, secret = _read(path)
    if secret is None:
        raise InputError(f"{path} holds no secret key; copy it anew from where it was made")
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
            f"{path} is not there; `bunraku bridge --make-keys DIR` makes the folders "
            f"DIR/{CAPTURE} (for the bridge) and DIR/{STAGE} (for the stage machine)"
        ) from error
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise InputError(f"{path} is no key; copy it anew from where it was made") from error
    return public, secret
