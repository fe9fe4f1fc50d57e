"""Makes a text from a file, an argument or the network safe to print."""

from __future__ import annotations

MOST_LETTERS = 1000


def printable(text: str, most: int = MOST_LETTERS) -> str:
    """The text in one line of at most `most` letters, without control characters.

    Blanks and line ends become one blank; control characters, and signs that reverse the direction
    of writing, become question marks.
    """
    line = " ".join(text.split())
    shown = "".join(letter if letter.isprintable() else "?" for letter in line[:most])
    return shown if len(line) <= most else f"{shown}..."
