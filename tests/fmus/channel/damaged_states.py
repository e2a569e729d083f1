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


def _place(body: bytes, rng: np.random.Generator) -> int:
    """Anywhere, but most often in the channel's own part, and there in the frames on air."""
    private, last = body.index(b"CHNL"), len(body) - 8
    frames, arrivals, reports = struct.unpack_from("<3Q", body, private + 56)
    on_air = last + 8 - frames * 160 - arrivals * 40 - reports * 40
    first = (0, private, on_air, on_air)[rng.integers(0, 4)]
    if first == on_air and rng.random() < 0.7:
        last = on_air + frames * 160
    return int(rng.integers(first, last))


def _damaged(body: bytes, rng: np.random.Generator) -> bytes:
    """One to three changes: a bit, a byte, or a number that is small, a border case or moved."""
    changed = bytearray(body)
    private = body.index(b"CHNL")
    for _ in range(int(rng.integers(1, 4))):
        at = _place(body, rng)
        word = at - (at - private) % 8
        match rng.integers(0, 5):
            case 0:
                changed[at] ^= 1 << int(rng.integers(0, 8))
            case 1:
                changed[at] = int(rng.integers(0, 256))
            case 2:
                changed[word : word + 8] = struct.pack("<Q", rng.integers(0, 20))
            case 3:
                changed[word : word + 8] = struct.pack("<Q", NUMBERS[rng.integers(0, len(NUMBERS))])
            case _:  # what stands there in the record before
                before = word - (8, 40, 160, 272)[rng.integers(0, 4)]
                changed[word : word + 8] = changed[before : before + 8]
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
