"""Copies of values that a call sets, as the engine finds them."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from orchestrator.plan import layouts
from orchestrator.system import Feed


@dataclass(frozen=True, slots=True)
class Driven:
    """An input that a call sets.

    Attributes:
        name: of the input.
        feed: what drives it, if it is no mix.
        copy: in the table of the engine.
        version: which of its values the source shows, where the engine counts them.
    """

    name: str
    feed: Feed | None
    copy: layouts.Copy
    version: ctypes.c_uint64

    @classmethod
    def of(cls, name: str, feed: Feed | None, copy: layouts.Copy) -> "Driven":
        """The input `name`, whose source is in `copy`."""
        return cls(name, feed, copy, ctypes.c_uint64.from_address(copy.source.version))

    def enter(self, *, is_set: bool) -> None:
        """Let the engine know whether the unit has the value that the source shows."""
        newest = self.version.value
        self.copy.seen = newest if is_set else newest - 1 & (1 << 64) - 1

    @property
    def is_newest(self) -> bool:
        """Whether the engine set the value that the source shows."""
        return bool(self.copy.seen == self.version.value)


def are_adjacent(copies: Sequence[layouts.Copy]) -> bool:
    """Whether the sources lie one after the other in memory, as they are to be set."""
    return all(
        one.source.base == other.source.base and one.source.offset + one.size == other.source.offset
        for one, other in pairwise(copies)
    )
