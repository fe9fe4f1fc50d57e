"""Read the parameters of a C3D file: names, units, rates, counts.

Every size is bounded by the section's, which has at most 255 blocks of 512 bytes.
Source: Motion Lab Systems, "The C3D File Format, User Guide", chapter "The parameter section".
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
_MOST_DIMENSIONS = 7
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}


@dataclass(frozen=True, slots=True)
class Parameters:
    """The parameters of a file by "GROUP:NAME", in upper case.

    Attributes:
        processor: INTEL, DEC or MIPS: how numbers are stored.
        found: the type, the dimensions and the bytes of each.
    """

    processor: int
    found: dict[str, tuple[int, tuple[int, ...], bytes]]

    def number(self, name: str, usual: float = 0.0) -> float:
        """The first number of a parameter; integers are without a sign."""
        kind, _, data = self.found.get(name, (0, (), b""))
        if kind == 4 and len(data) >= 4:
            return float(floats(data[:4], self.processor)[0])
        if kind == 2 and len(data) >= 2:
            return float(struct.unpack_from(self.order + "H", data)[0])
        return float(data[0]) if kind == 1 and data else usual

    def words(self, name: str) -> tuple[int, ...]:
        """The numbers of 16 bits of a parameter, without a sign."""
        kind, _, data = self.found.get(name, (0, (), b""))
        if kind != 2:
            return ()
        return struct.unpack(f"{self.order}{len(data) // 2}H", data[: len(data) & -2])

    def texts(self, name: str) -> list[str]:
        """The texts of a parameter, without blanks around them."""
        kind, dimensions, data = self.found.get(name, (0, (), b""))
        if kind != -1 or not dimensions or not dimensions[0]:
            return []
        width = dimensions[0]
        pieces = (data[at : at + width] for at in range(0, len(data), width))
        return [_text(piece) for piece in pieces]

    @property
    def order(self) -> str:
        """The order of bytes, as `struct` writes it."""
        return ">" if self.processor == MIPS else "<"


def read_parameters(data: bytes) -> Parameters:
    """Read the parameter section of a whole file.

    Raises:
        ContentError: it is damaged.
    """
    start = (data[0] - 1) * BLOCK if data else -1
    head = data[start : start + 4] if start >= 0 else b""
    if len(head) < 4 or head[3] not in (INTEL, DEC, MIPS):
        raise ContentError("its parameters are damaged; export it again")
    processor = head[3]
    section = data[start : start + max(head[2], 1) * BLOCK]
    order = ">" if processor == MIPS else "<"
    groups: dict[int, str] = {}
    numbered: list[tuple[int, str, tuple[int, tuple[int, ...], bytes]]] = []
    at = 4
    while at + 2 <= len(section):
        letters, group = struct.unpack_from("bb", section, at)
        end = at + 2 + abs(letters)
        if not letters or not group or end + 2 > len(section):
            break
        name = _text(section[at + 2 : end]).upper()
        step = struct.unpack_from(order + "H", section, end)[0]
        body = section[end + 2 : end + step if step else len(section)]
        if group < 0:
            groups.setdefault(-group, name)
        else:
            numbered.append((group, name, _value(body)))
        if step < 2:
            break
        at = end + step
    found = {f"{groups.get(group, '')}:{name}": value for group, name, value in reversed(numbered)}
    return Parameters(processor, found)


def _value(body: bytes) -> tuple[int, tuple[int, ...], bytes]:
    """Type, dimensions and bytes of a parameter; no bytes where they are not all there."""
    if len(body) < 2 or body[1] > _MOST_DIMENSIONS or len(body) < 2 + body[1]:
        return 0, (), b""
    kind = struct.unpack_from("b", body)[0]
    dimensions = tuple(body[2 : 2 + body[1]])
    count = _SIZES.get(kind, 0)
    for dimension in dimensions:
        count *= dimension
    content = body[2 + body[1] :]
    return (kind, dimensions, content[:count]) if 0 < count <= len(content) else (0, (), b"")


def floats(data: bytes | memoryview, processor: int) -> NDArray[np.floating]:
    """The numbers of 32 bits in some bytes, which may be DEC's."""
    if processor != DEC:
        return np.frombuffer(data, dtype=">f4" if processor == MIPS else "<f4")
    words = np.frombuffer(data, dtype="<u2").reshape(-1, 2)
    swapped: NDArray[np.floating] = np.ascontiguousarray(words[:, ::-1]).view("<f4")[:, 0] / 4.0
    return swapped


def _text(raw: bytes) -> str:
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return text.replace("\0", " ").strip()
