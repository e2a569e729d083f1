"""Messages and files of every codec, changed: read as a value, or refused as declared."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tests.reliability.area import Outcome, of_cases
from tests.reliability.codecs import Codec
from tests.reliability.file_codecs import file_codecs
from tests.reliability.isolation import Bounds, isolated
from tests.reliability.record_codecs import record_codecs
from tests.reliability.wire_codecs import wire_codecs

_BOUNDS: Final = Bounds(seconds=30, megabytes=3000, together=2000)
_VALID: Final = 64
"""So many valid messages of each codec are changed."""

CODECS: Final = 15 + 12 + 13
"""How many there are; the case of a number is of the codec with its remainder."""


def performer(seed: int, folder: Path) -> "Perform":
    """See `isolation.isolated`."""
    work = folder / "files"
    codecs = [*wire_codecs(work), *record_codecs(), *file_codecs(work)]
    if len(codecs) != CODECS:
        raise RuntimeError(f"there are {len(codecs)} codecs")
    perform = Perform(seed, codecs)
    for codec in codecs:
        perform.valid(codec, 0)  # what is imported for it is, before copies are made
    return perform


@dataclass(frozen=True, slots=True)
class Perform:
    """Performs cases of `seed`."""

    seed: int
    codecs: Sequence[Codec]
    known: dict[tuple[str, int], bytes] = field(default_factory=dict)

    def kind(self, number: int) -> str:
        """Of the case."""
        return self.codecs[number % len(self.codecs)].name

    def valid(self, codec: Codec, number: int) -> bytes:
        """A valid message of `codec`."""
        key = codec.name, number
        if key not in self.known:
            rng = random.Random(f"valid {self.seed} {codec.name} {number}")  # noqa: S311
            self.known[key] = codec.valid(rng)
        return self.known[key]

    def message(self, number: int) -> tuple[Codec, bytes]:
        """What is read in a case."""
        codec = self.codecs[number % len(self.codecs)]
        rng = random.Random(f"messages {self.seed} {number}")  # noqa: S311
        valid = self.valid(codec, rng.randrange(_VALID))
        return codec, valid if rng.random() < 0.02 else codec.mutate(valid, rng)

    def __call__(self, number: int) -> Outcome:
        codec, message = self.message(number)
        why = codec.fault(message)
        return Outcome(number, codec.name, not why, why)


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    return isolated("tests.reliability.messages:performer", seed, numbers, _BOUNDS)


MESSAGES: Final = of_cases(
    "messages",
    f"messages and files of {CODECS} codecs, changed: read as a value that is the same when it is "
    "encoded and read again, or refused with the error that is declared",
    full=100_000 * CODECS,
    small=5 * CODECS,
    some=_some,
)
