"""Copies of values that a call sets, as the engine finds them."""

import ctypes
from collections.abc import Sequence
from itertools import pairwise

from orchestrator.plan import layouts


def are_adjacent(copies: Sequence[layouts.Copy]) -> bool:
    """Whether the sources lie one after the other in memory, as they are to be set."""
    return all(
        one.source.base == other.source.base and one.source.offset + one.size == other.source.offset
        for one, other in pairwise(copies)
    )


def version_of(copy: layouts.Copy) -> int:
    """Which of its values the source shows."""
    return ctypes.c_uint64.from_address(copy.source.version).value
