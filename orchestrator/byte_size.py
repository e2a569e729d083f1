"""Amounts of memory as people write them."""

import re
from fractions import Fraction
from typing import Final

PATTERN: Final = r"^\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*([kMGT]i?B)\s*$"

_FACTORS: Final = {
    "kB": 10**3,
    "MB": 10**6,
    "GB": 10**9,
    "TB": 10**12,
    "kiB": 1 << 10,
    "MiB": 1 << 20,
    "GiB": 1 << 30,
    "TiB": 1 << 40,
}


def parse_size(text: str) -> int:
    """The amount that `text` says, e.g. `512 MB` or `1.5 GiB` [byte], rounded down.

    Raises:
        ValueError: it is no positive amount with a unit.
    """
    found = re.fullmatch(PATTERN, text)
    size = int(Fraction(found[1]) * _FACTORS[found[2]]) if found is not None else 0
    if size <= 0:
        raise ValueError(f"expected an amount of memory such as `512 MB` or `2 GiB`, got `{text}`")
    return size


def format_size(size: int) -> str:
    """`size` [byte] in the largest unit of which it has one, to three digits."""
    for unit in ("TB", "GB", "MB"):
        if size >= _FACTORS[unit]:
            return f"{size / _FACTORS[unit]:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"


def written_size(size: int) -> str:
    """What `parse_size` reads as exactly `size` [byte], in the largest unit that is whole."""
    for unit, factor in sorted(_FACTORS.items(), key=lambda each: -each[1]):
        if size % factor == 0:
            return f"{size // factor} {unit}"
    return f"{size // 1000}.{size % 1000:03d} kB"
