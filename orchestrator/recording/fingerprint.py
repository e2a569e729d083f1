"""One number for everything that was recorded.

It depends on the times, types, shapes and bytes of all recorded signals, and on nothing else:
not on wall time, on the host, on where components ran or on how often files were flushed.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, order=True)
class PartDigest:
    """The digest of one file of a recording.

    Attributes:
        name: the file's path within the run directory, with forward slashes.
        kind: the declared type of the signal; empty for times and lengths.
        sha256: of the rows, as hexadecimal digits.
    """

    name: str
    kind: str
    sha256: str


def fingerprint(parts: Iterable[PartDigest]) -> str:
    """SHA-256 over the digests of all parts, sorted by name."""
    total = hashlib.sha256()
    for part in sorted(parts):
        total.update(f"{part.name}\t{part.kind}\t{part.sha256}\n".encode())
    return total.hexdigest()
