"""Bytes, changed as a bad line, a bad disk or a bad peer changes them."""

import json
import random
from collections.abc import Callable
from typing import Any, Final

from tests.reliability.yaml_mutations import mutated_data

_EDGES: Final = (0, 1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1,
                 2**63, 2**64 - 1)  # fmt: skip


def _flip(data: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _cut(data: bytearray, rng: random.Random) -> None:
    del data[rng.randrange(len(data)) :]


def _extend(data: bytearray, rng: random.Random) -> None:
    data += rng.choice((bytes(rng.choice((1, 4, 8, 100))), rng.randbytes(rng.randrange(1, 40))))


def _number(data: bytearray, rng: random.Random) -> None:
    """Put a number at the edge of a range where one may stand."""
    size = rng.choice((1, 2, 4, 8))
    if len(data) >= size:
        place = rng.randrange(len(data) - size + 1)
        place -= place % rng.choice((1, size))
        number = rng.choice(_EDGES) % 2 ** (8 * size)
        data[place : place + size] = number.to_bytes(size, "little")


def _remove(data: bytearray, rng: random.Random) -> None:
    place = rng.randrange(len(data))
    del data[place : place + rng.choice((1, 2, 4, 8, 16, 100))]


def _repeat(data: bytearray, rng: random.Random) -> None:
    place, size = rng.randrange(len(data)), rng.choice((1, 4, 8, 16, 100))
    data[place:place] = data[place : place + size]


def _move(data: bytearray, rng: random.Random) -> None:
    place, size = rng.randrange(len(data)), rng.choice((1, 4, 8, 16, 100))
    piece = data[place : place + size]
    del data[place : place + size]
    place = rng.randrange(len(data) + 1)
    data[place:place] = piece


_WAYS: Final[tuple[Callable[[bytearray, random.Random], None], ...]] = (
    _flip, _flip, _flip, _cut, _extend, _number, _number, _remove, _repeat, _move,
)  # fmt: skip


def mutated_bytes(content: bytes, rng: random.Random) -> bytes:
    """`content`, changed in one or several ways."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if data:
            rng.choice(_WAYS)(data, rng)
    return bytes(data)


def mutated_document(document: Any, rng: random.Random) -> bytes:
    """A document as JSON, its structure or its text changed."""
    if rng.random() < 0.25:
        return mutated_bytes(json.dumps(document).encode(), rng)
    if rng.random() < 0.02:
        return rng.choice((b"[" * 100_000, b'{"a":' * 100_000, b"9" * 5000, b"null", b"[]", b"3"))
    return json.dumps(mutated_data(document, rng), default=str).encode()
