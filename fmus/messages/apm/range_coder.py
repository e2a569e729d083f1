"""A binary range coder that learns how probable each decision is.

docs/formats.md describes it; `fmus/perception/range_coder.c` is the same code in C, and both make
the same bytes. An encoder is told each decision, a decoder finds it out; `decide` returns it in
both cases, so that what describes a matrix by decisions is written once.
"""

import abc
from typing import Final

from typing_extensions import override

_ONE: Final = 1 << 16
"""The share that is certainty."""
_SLOWEST: Final = 32
"""Part of its error by which a share changes at least, once it has learnt."""
_BITS: Final = 8
_TOP: Final = 24
_ALL: Final = (1 << 32) - 1


class Decision:
    """What is known about one kind of decision.

    Attributes:
        share: of the answers so far, the part that was yes, in 1 / 65536; never 0 or 65536.
        inertia: the inverse of the part of its error by which the share changes next: 2 at
            first, one more after each decision, up to 32.
    """

    __slots__ = ("inertia", "share")

    def __init__(self) -> None:
        self.share = _ONE // 2
        self.inertia = 2

    def learn(self, *, yes: bool) -> None:
        """Move the share towards the answer."""
        if yes:
            self.share += (_ONE - self.share) // self.inertia
        else:
            self.share -= self.share // self.inertia
        if self.inertia < _SLOWEST:
            self.inertia += 1


def decisions(count: int) -> list[Decision]:
    """Kinds of decisions, `count` of them, about which nothing is known."""
    return [Decision() for _ in range(count)]


class Coder(abc.ABC):
    """Takes decisions in the order of the code."""

    def __init__(self) -> None:
        self._low, self._high = 0, _ALL  # the code goes on with a number between these

    def decide(self, about: Decision, *, yes: bool) -> bool:
        """The answer to one decision: `yes` when writing; what the code says when reading.

        Raises:
            ValueError: the code is cut short.
        """
        middle = self._low + ((self._high - self._low) * about.share >> 16)
        yes = self._answer(middle, yes=yes)
        if yes:
            self._high = middle
        else:
            self._low = middle + 1
        about.learn(yes=yes)
        while (self._low ^ self._high) >> _TOP == 0:
            self._shift()
            self._low = self._low << 8 & _ALL
            self._high = self._high << 8 & _ALL | 0xFF
        return yes

    def byte(self, about: list[Decision], byte: int, most: int = 255) -> int:
        """A byte, 0 to `most`, bit by bit from the highest one.

        A bit that cannot be set because the byte would pass `most` is no decision.

        Args:
            about: 256 kinds of decisions; that about a bit depends on all bits before it.
            byte: what is written; nothing of it counts when reading.
            most: the largest byte that there can be.
        """
        node = 1
        for bit in reversed(range(_BITS)):
            node *= 2
            if ((node + 1) << bit) - (1 << _BITS) <= most:
                node += self.decide(about[node // 2], yes=bool(byte >> bit & 1))
        return node - (1 << _BITS)

    @abc.abstractmethod
    def _answer(self, middle: int, *, yes: bool) -> bool:
        """Whether the number is at most `middle`."""

    @abc.abstractmethod
    def _shift(self) -> None:
        """Be done with the upper byte of the interval, in which all its numbers agree."""


class Encoder(Coder):
    """Writes a code from decisions."""

    def __init__(self) -> None:
        super().__init__()
        self._code = bytearray()

    def finish(self) -> bytes:
        """The code of all decisions."""
        return bytes(self._code) + _last_bytes(self._low, self._high)

    @override
    def _answer(self, middle: int, *, yes: bool) -> bool:
        return yes

    @override
    def _shift(self) -> None:
        self._code.append(self._low >> _TOP)


class Decoder(Coder):
    """Reads decisions from `code`."""

    def __init__(self, code: bytes) -> None:
        super().__init__()
        self._left = iter(code)
        self._size, self._done = len(code), 0
        self._check_end()
        self._value = 0
        for _ in range(4):
            self._value = self._value << 8 | next(self._left, 0)

    def finish(self) -> None:
        """Check that the code ends after these decisions.

        Raises:
            ValueError: it goes on, or ends otherwise than `Encoder.finish` does.
        """
        expected = _last_bytes(self._low, self._high)
        left = self._size - self._done - len(expected)
        if left < 0:
            raise ValueError("a compressed APM is cut short")
        if left:
            raise ValueError(f"a compressed APM has {left} bytes too many")
        if self._value.to_bytes(4, "big")[: len(expected)] != expected:
            raise ValueError("a compressed APM ends in other bytes than its cells make")

    @override
    def _answer(self, middle: int, *, yes: bool) -> bool:
        return self._value <= middle

    @override
    def _shift(self) -> None:
        self._done += 1
        self._check_end()
        self._value = self._value << 8 & _ALL | next(self._left, 0)

    def _check_end(self) -> None:
        if self._done >= self._size:
            raise ValueError("a compressed APM is cut short")


def _last_bytes(low: int, high: int) -> bytes:
    """The fewest bytes after which the number is in its interval whatever follows; the lowest ones.

    So no code begins with another one.
    """
    for size in range(1, 5):
        step = 1 << 32 - 8 * size
        first = -(-low // step)
        if (first + 1) * step - 1 <= high:
            return first.to_bytes(size, "big")
    raise AssertionError("the interval is empty")
