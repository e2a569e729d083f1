"""Random numbers by counter, the same as those of the lidar FMU (fmus/lidar/random.h).

PyTorch has no unsigned 64-bit arithmetic: int64 wraps around in the same way, and what a shift
to the right brings in from the sign is masked away.
"""

from typing import Final

import torch
from torch import Tensor

_WORD: Final = 2**64 - 1
_GOLDEN: Final = 0x9E3779B97F4A7C15
"""2^64 / golden ratio."""
_FACTORS: Final = (0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
_LOW_HALF: Final = 2**32 - 1


def _signed(word: int) -> int:
    """The int64 with the bits of `word`, 0..2^64-1."""
    return word - 2**64 if word >= 2**63 else word


def _mix(x: int) -> int:
    """The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; Stafford's variant 13)."""
    x = (x ^ (x >> 30)) * _FACTORS[0] & _WORD
    x = (x ^ (x >> 27)) * _FACTORS[1] & _WORD
    return x ^ (x >> 31)


def _shifted(x: Tensor, bits: int) -> Tensor:
    shifted: Tensor = (x >> bits) & (2 ** (64 - bits) - 1)
    return shifted


def scan_key(seed: int, time: int, vehicle: int) -> int:
    """The key of all random numbers of one scan of one sensor, as an int64.

    Args:
        seed: of the component, int64.
        time: of the scan [ns].
        vehicle: that carries the sensor.
    """
    key = _mix((seed + _GOLDEN) & _WORD)
    for word in (time, vehicle):
        key = _mix(((key ^ (word & _WORD)) + _GOLDEN) & _WORD)
    return _signed(key)


def ray_salts(azimuths: int, channels: int) -> Tensor:
    """What a key is added to for each ray, int64, shape (azimuths * channels,)."""
    ray = (torch.arange(azimuths)[:, None] << 32) | torch.arange(channels)
    return (ray.flatten() + 1) * _signed(_GOLDEN)


def random_bits(counter: Tensor) -> Tensor:
    """64 random bits for each sum of a key and a salt, int64, of the shape of `counter`."""
    x = (counter ^ _shifted(counter, 30)) * _signed(_FACTORS[0])
    x = (x ^ _shifted(x, 27)) * _signed(_FACTORS[1])
    return x ^ _shifted(x, 31)


def low_half(bits: Tensor) -> Tensor:
    """The lower 32 bits as numbers 0..2^32-1; int64, of the shape of `bits`, which is int64."""
    return bits & _LOW_HALF


def high_half(bits: Tensor) -> Tensor:
    """The upper 32 bits as numbers 0..2^32-1; int64, of the shape of `bits`, which is int64."""
    return _shifted(bits, 32)


def normal_quantile(bits: Tensor) -> Tensor:
    """Numbers of the standard normal distribution from 32 random bits each.

    The quantile of the middle of the bits' interval of width 2^-32 (Wichura, AS 241, Applied
    Statistics 37, 1988, routine PPND7: relative error 1e-7).

    Args:
        bits: 0..2^32-1, int64, any shape.

    Returns:
        Quantiles, float64, of the shape of `bits`.
    """
    p = (bits.double() + 0.5) * 2.0**-32
    q = p - 0.5
    r = 0.180625 - q * q
    above = 3.3871327179 + r * (50.434271938 + r * (159.29113202 + r * 59.109374720))
    below = 1.0 + r * (17.895169469 + r * (78.757757664 + r * 67.187563600))
    tail = torch.sqrt(-torch.log(torch.minimum(p, 1.0 - p))) - 1.6
    far = 1.4234372777 + tail * (2.7568153900 + tail * (1.3067284816 + tail * 0.17023821103))
    far = far / (1.0 + tail * (0.73700164250 + tail * 0.12021132975))
    return torch.where(q.abs() <= 0.425, q * above / below, torch.copysign(far, q))
