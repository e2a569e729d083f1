"""What a lost packet costs: the whole message, nothing, or what it carried."""

import abc
from collections.abc import Collection, Set
from dataclasses import dataclass
from typing import Final

from typing_extensions import override


class Granularity(abc.ABC):
    """Which part of a message is of use when only some of its packets have arrived."""

    @property
    @abc.abstractmethod
    def grain(self) -> int:
        """Bytes that stay together: each packet carries a whole number of grains."""

    @abc.abstractmethod
    def usable(self, arrived: Set[int], count: int) -> Collection[int]:
        """The packets whose contents the receiver has.

        Args:
            arrived: which of the packets 0 to `count - 1` have arrived; not all of them.
            count: packets of the message.

        Returns:
            Some of 0 to `count - 1`; the more the more have arrived.
        """


@dataclass(frozen=True, slots=True)
class AllPackets(Granularity):
    """One lost packet costs the whole message."""

    @property
    @override
    def grain(self) -> int:
        return 1

    @override
    def usable(self, arrived: Set[int], count: int) -> Collection[int]:
        return ()


ALL_PACKETS: Final = AllPackets()


@dataclass(frozen=True, slots=True)
class FirstPacket(Granularity):
    """The first packet stands for the whole message; the others only load the medium.

    The reading under which a packet error rate is the share of scans that are lost.
    """

    @property
    @override
    def grain(self) -> int:
        return 1

    @override
    def usable(self, arrived: Set[int], count: int) -> Collection[int]:
        return range(count) if 0 in arrived else ()


@dataclass(frozen=True, slots=True)
class EachGrain(Granularity):
    """A lost packet costs the grains in it (application-level framing).

    Args:
        size: of a grain [byte].
    """

    size: int

    @property
    @override
    def grain(self) -> int:
        return self.size

    @override
    def usable(self, arrived: Set[int], count: int) -> Collection[int]:
        return arrived
