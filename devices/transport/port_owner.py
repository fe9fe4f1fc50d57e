"""Find the process that holds a UDP or TCP port of this machine, from Linux's /proc."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

PROC = Path("/proc")


@dataclass(frozen=True, slots=True)
class Owner:
    """A process that holds a port."""

    process: int
    name: str


def port_owner(port: int, protocol: Literal["udp", "tcp"] = "udp") -> Owner | None:
    """Return the process bound to `port`, or None if there is none or it is unknown."""
    inodes = set(_inodes(port, protocol))
    if not inodes:
        return None
    links = {f"socket:[{inode}]" for inode in inodes}
    for folder in PROC.glob("[0-9]*"):
        try:
            if any(str(entry.readlink()) in links for entry in (folder / "fd").iterdir()):
                name = (folder / "comm").read_text(encoding="utf-8", errors="replace").strip()
                return Owner(int(folder.name), name)
        except OSError:
            continue  # the process has ended, or belongs to another user
    return None


def _inodes(port: int, protocol: str) -> Iterator[str]:
    """Yield socket inodes from /proc/net, whose rows hold "address:port" in hexadecimal."""
    for table in (protocol, f"{protocol}6"):
        try:
            rows = (PROC / "net" / table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        for row in rows:
            fields = row.split()
            listening = protocol == "udp" or fields[3] == "0A"
            if listening and int(fields[1].rpartition(":")[2], 16) == port:
                yield fields[9]
