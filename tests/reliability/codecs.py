"""What a codec is to the campaign, and when two values are the same."""

import dataclasses
import json
import random
import struct
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.reliability.byte_mutations import mutated_bytes, mutated_document


@dataclass(frozen=True, slots=True, kw_only=True)
class Codec:
    """A form in which values travel or rest.

    Attributes:
        name: its row in the table.
        valid: makes a value, and returns it as it is sent or written.
        decode: reads that, or what became of it, from bytes.
        encode: the opposite; `None` if there is none, or not of all that can be decoded.
        errors: what `decode` declares to raise.
        mutate: changes what is sent.
    """

    name: str
    valid: Callable[[random.Random], bytes]
    decode: Callable[[bytes], Any]
    encode: Callable[[Any], bytes] | None = None
    errors: tuple[type[BaseException], ...] = ()
    mutate: Callable[[bytes, random.Random], bytes] = mutated_bytes

    def fault(self, message: bytes) -> str:
        """What is wrong with how `message` is read; empty if nothing is."""
        try:
            value = self.decode(message)
        except self.errors:
            return ""
        except BaseException as error:
            return f"decoding raises {error!r:.200}"
        if self.encode is None:
            return ""
        try:
            again = self.decode(self.encode(value))
        except BaseException as error:
            return f"what was decoded cannot be encoded and decoded again: {error!r:.200}"
        deep, limit = 20_000, sys.getrecursionlimit()
        sys.setrecursionlimit(deep)  # what was read may be nested as deep as the limit allows
        try:
            return "" if bits(again) == bits(value) else "encoded again it is another value"
        finally:
            sys.setrecursionlimit(limit)


def of_file(suffix: str, read: Callable[[Path], Any], folder: Path) -> Callable[[bytes], Any]:
    """A `decode` for what is in a file, which is written into `folder`."""
    path = folder / f"case{suffix}"

    def decode(content: bytes) -> Any:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        return read(path)

    return decode


def of_document(valid: Callable[[random.Random], Any]) -> Callable[[random.Random], bytes]:
    """A `valid` for documents of JSON, which `mutate_document` changes."""
    return lambda rng: json.dumps(valid(rng)).encode()


def mutate_document(content: bytes, rng: random.Random) -> bytes:
    """Change the structure of a document of JSON."""
    return mutated_document(json.loads(content), rng)


def bits(value: Any) -> Any:
    """Everything that makes two values the same, NaN payloads included; can be compared."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [(f.name, bits(getattr(value, f.name))) for f in dataclasses.fields(value)]
    match value:
        case np.ndarray() | np.generic():
            return value.dtype.str, value.shape, value.tobytes()
        case float():
            return struct.pack("<d", value)
        case Mapping():
            return [(bits(key), bits(each)) for key, each in value.items()]
        case list() | tuple():
            return [bits(each) for each in value]
    return value
