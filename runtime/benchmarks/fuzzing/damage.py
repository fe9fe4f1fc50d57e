"""Random damage to valid inputs: bits, words, lengths, tokens, characters, cuts and repeats."""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence

MOST_BYTES = 1 << 16
_TOKENS = (
    b"null",
    b"nan",
    b"NaN",
    b"-inf",
    b"1e999",
    b"-1e308",
    b"1e-320",
    b"-0",
    b"0",
    b"1,5",
    b"9" * 400,
    b"-2147483649",
    b"18446744073709551616",
    b"[" * 500,
    b"{}",
    b'""',
    b"true",
    b"\n\n",
    b"#",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\0" * 8,
    b"\x1b]0;a\x07",
    "\u2212\u0661\u200f".encode(),
    b"../../a",
    b"/" * 300,
)
_WORDS = (0, 1, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000)
_SIGNS = b'0123456789-+e.,;:"[]{}() \t\r\n\\/#x\x00\xff'


def damaged(chance: random.Random, samples: Sequence[bytes]) -> bytes:
    """One of the samples with one to six damages, and now and then the end of another one."""
    data = bytearray(chance.choice(samples))
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        place = chance.randrange(len(data) + 1)
        end = place + chance.choice((1, 4, 16, 200))
        match chance.randrange(10):
            case 0 if data:
                data[place - 1] ^= 1 << chance.randrange(8)
            case 1 if len(data) >= 4:
                word = min(place, len(data) - 4)
                value = chance.choice((*_WORDS, chance.getrandbits(32)))
                struct.pack_into(chance.choice("<>") + "I", data, word, value)
            case 2:
                token = chance.choice(_TOKENS)
                data[place : place + chance.choice((0, 1, len(token)))] = token
            case 3:
                data[place : place + 1] = bytes([chance.choice(_SIGNS)])
            case 4:
                del data[place:end]
            case 5:
                data[place:place] = data[place:end] * chance.choice((1, 1, 2, 50))
            case 6 if chance.random() < 0.3:
                del data[place:]
            case 7 if chance.random() < 0.3:
                data[place:] = chance.choice(samples)[place:]
            case 8:
                _swap_words(chance, data)
            case _:
                data[place:end] = chance.randbytes(len(data[place:end]))
    return bytes(data[:MOST_BYTES])


def _swap_words(chance: random.Random, data: bytearray) -> None:
    """Exchange two words of a text."""
    words = data.split(b" ")
    if len(words) > 2:
        one, other = chance.randrange(len(words)), chance.randrange(len(words))
        words[one], words[other] = words[other], words[one]
        data[:] = b" ".join(words)
