"""Decompress lz-string text (`compressToBase64`), the format of the LeapJS recorder.

An LZ78 code: each number is an entry of the dictionary or announces a new character; its width
follows the dictionary's size. The bits lie in the base64 digits from the highest, the numbers from
the lowest, so each digit is reversed once and all are read as one stream from the lowest bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

_DIGITS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
_REVERSED = {digit: int(f"{value:06b}"[::-1], 2) for value, digit in enumerate(_DIGITS)}
_NEW_8_BITS, _NEW_16_BITS, _END = 0, 1, 2


def lz_pieces(base64: bytes) -> Iterator[str]:
    """Yield the pieces of the decompressed text, so that the caller may stop at a bound.

    Raises:
        ValueError: a character is not a base64 digit, a number is invalid, or the end is missing.
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
            piece = previous + previous[0]  # the entry that is made next
        else:
            raise ValueError(f"number {number} is not in a dictionary of {len(dictionary)}")
        yield piece
        if previous:
            dictionary.append(previous + piece[0])
        previous = piece


def _bits(base64: bytes) -> Callable[[int], int]:
    """Return a function that reads the next `count` bits as a number."""
    digits = iter(base64)
    pending, width = 0, 0

    def read(count: int) -> int:
        nonlocal pending, width
        while width < count:
            digit = _REVERSED.get(next(digits, -1))
            if digit is None:
                raise ValueError("the compressed text is truncated or not base64")
            pending |= digit << width
            width += 6
        number = pending & ((1 << count) - 1)
        pending >>= count
        width -= count
        return number

    return read
