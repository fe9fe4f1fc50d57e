"""Text compressed by lz-string (`compressToBase64`), as the LeapJS recorder stores it.

An LZ78 code: each number either is an entry of the dictionary or announces a new character; it is
as wide as the dictionary's size. The bits lie in the base64 digits from the highest, the numbers
from the lowest, so each digit is turned round once and all is read as one stream from the lowest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

_DIGITS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
_TURNED = {digit: int(f"{value:06b}"[::-1], 2) for value, digit in enumerate(_DIGITS)}
_NEW_8_BITS, _NEW_16_BITS, _END = 0, 1, 2


def lz_pieces(base64: bytes) -> Iterator[str]:
    """The pieces of the decompressed text, one by one, so that the caller may stop at a bound.

    Raises:
        ValueError: a character that is no base64 digit, a number that means nothing, or no end.
    """
    read = _bits(base64)
    dictionary = ["", "", ""]  # the three numbers above
    previous = ""
    while (number := read(len(dictionary).bit_length())) != _END:
        if number in (_NEW_8_BITS, _NEW_16_BITS):
            dictionary.append(chr(read(8 if number == _NEW_8_BITS else 16)))
            number = len(dictionary) - 1
        if number < len(dictionary):
            piece = dictionary[number]
        elif number == len(dictionary) and previous:
            piece = previous + previous[0]  # the entry that is about to be made
        else:
            raise ValueError(f"number {number} is not in a dictionary of {len(dictionary)}")
        yield piece
        if previous:
            dictionary.append(previous + piece[0])
        previous = piece


def _bits(base64: bytes) -> Callable[[int], int]:
    """A function that reads the next `count` bits as a number."""
    digits = iter(base64)
    waiting, held = 0, 0

    def read(count: int) -> int:
        nonlocal waiting, held
        while held < count:
            turned = _TURNED.get(next(digits, -1))
            if turned is None:
                raise ValueError("the compressed text breaks off, or holds what is no base64")
            waiting |= turned << held
            held += 6
        number = waiting & ((1 << count) - 1)
        waiting >>= count
        held -= count
        return number

    return read
