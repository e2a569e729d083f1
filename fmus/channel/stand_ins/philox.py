"""Random numbers that are a function of what they decide, not of what was drawn before.

NumPy's own Philox is the 4x64 variant and yields sequences, not one number per counter; the
channel FMU draws from 4x32, and so do its stand-ins.
"""

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

UInt64 = npt.NDArray[np.uint64]
Float = npt.NDArray[np.float64]

_MULTIPLIERS: Final = np.array([[0xD2511F53], [0xCD9E8D57]], np.uint64)
_WEYL: Final = np.array([0x9E3779B9, 0xBB67AE85], np.uint64)
_ROUNDS: Final = 10
_LOW: Final = np.uint64(0xFFFFFFFF)
_HALF: Final = np.uint64(32)

RECEPTION: Final = 0
"""The use of a draw: whether a frame is received. As in the channel FMU."""


def philox4x32(counter: UInt64, key: tuple[int, int]) -> UInt64:
    """Philox4x32-10 of many counters under one key.

    J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as
    1, 2, 3", SC 2011, section 3.3.

    Args:
        counter: words of 32 bits, shape (4, draw).
        key: words of 32 bits.

    Returns:
        Words of 32 bits, shape (4, draw).
    """
    even, odd = counter[0::2], counter[1::2]
    for round_key in _round_keys(key):
        product = _MULTIPLIERS * even
        even = (product >> _HALF)[::-1] ^ odd ^ round_key
        odd = (product & _LOW)[::-1]
    return np.stack([even, odd], axis=1).reshape(4, -1)


@lru_cache(maxsize=64)
def _round_keys(key: tuple[int, int]) -> UInt64:
    """The keys of the rounds, shape (round, 2, 1)."""
    steps = np.arange(_ROUNDS, dtype=np.uint64)[:, None] * _WEYL
    keys: UInt64 = (np.array(key, np.uint64) + steps & _LOW)[..., None]
    return keys


def reception_draws(seed: int, packet: int, hop: int, receivers: npt.NDArray[np.int64]) -> Float:
    """One uniform number in [0, 1) per receiver of a frame; a function of the arguments alone.

    Args:
        seed: 0..2^64-1.
        packet: number of the packet.
        hop: of the frame, 0 = sent by the source.
        receivers: numbers of the vehicles, shape (receiver,).

    Returns:
        Multiples of 2^-53, shape (receiver,).
    """
    number = packet & 0xFFFFFFFFFFFFFFFF
    counter = np.empty((4, len(receivers)), np.uint64)
    counter[0] = number & 0xFFFFFFFF
    counter[1] = number >> 32
    counter[2] = receivers.astype(np.uint64) & _LOW
    counter[3] = RECEPTION << 16 | hop
    high, low, *_ = philox4x32(counter, (seed & 0xFFFFFFFF, seed >> 32))
    draws: Float = (high << _HALF | low) >> np.uint64(11)
    return draws * 2.0**-53
