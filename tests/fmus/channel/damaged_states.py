"""Loads damaged states: `python -m tests.fmus.channel.damaged_states SEED COUNT FOLDER`.

Prints how many were refused and how many ran on. Whatever else happens ends the process.
"""

import struct
import sys
from pathlib import Path

import numpy as np

from tests.fmus.driver import Library, Refused

from .harness import Channel
from .town import BUSY, TOWN, busy_traffic

ENVELOPE = struct.Struct("<8sQQ")
CUTS = (0.0021, 0.0093, 0.0307)
NUMBERS = (0, 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1)


def _sealed(body: bytes) -> bytes:
    """The body of a state in an envelope with the right checksum (FNV-1a)."""
    checksum = 14695981039346656037
    for byte in body:
        checksum = ((checksum ^ byte) * 1099511628211) & 0xFFFFFFFFFFFFFFFF
    return ENVELOPE.pack(b"FMU3STA1", checksum, len(body)) + body


def _damaged(body: bytes, rng: np.random.Generator) -> bytes:
    """One to three changes: a bit, a byte, or a number that is a border case."""
    changed = bytearray(body)
    private = body.index(b"CHNL")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(private if rng.random() < 0.9 else 0, len(body) - 8))
        kind = rng.integers(0, 3)
        if kind == 0:
            changed[at] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            changed[at] = int(rng.integers(0, 256))
        else:
            at -= (at - private) % 8
            changed[at : at + 8] = struct.pack("<Q", NUMBERS[rng.integers(0, len(NUMBERS))])
    return bytes(changed)


def _run_on(library: Library, state: bytes, start: float) -> bool:
    """Whether the state is accepted; what happens then may be an error, too."""
    with Channel(library, TOWN, **BUSY) as channel:
        try:
            channel.restore(state)
        except Refused:
            return False
        try:
            for k in range(3):
                channel.step(start + k * 0.01, 0.01, [])
            channel.restore(channel.save())
        except Refused:
            pass
        return True


def main(seed: int, count: int, folder: Path) -> None:
    library = Library.load("channel", folder)
    rng = np.random.default_rng(seed)
    bodies = []
    for cut in CUTS:
        with Channel(library, TOWN, **BUSY) as channel:
            channel.step(0.0, cut, busy_traffic(120))
            bodies.append(channel.save()[ENVELOPE.size :])
    ran = 0
    for _ in range(count):
        which = int(rng.integers(0, len(CUTS)))
        ran += _run_on(library, _sealed(_damaged(bodies[which], rng)), CUTS[which])
    print(count - ran, ran)  # noqa: T201 - the answer


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
