"""Names in binaries."""

from typing import Final

LONGEST: Final = 4096
"""A longer name is none [byte]."""


def text_at(binary: bytes, place: int) -> str:
    """The text that begins at `place` and ends before the next zero.

    Raises:
        ValueError: it does not end.
    """
    return binary[place : binary.index(b"\0", place, place + LONGEST)].decode("utf-8", "replace")
