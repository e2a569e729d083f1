"""How long a frame is on the air."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from orchestrator.timebase import Duration

BITS_PER_SYMBOL: Final[Mapping[float, int]] = MappingProxyType(
    {3e6: 24, 4.5e6: 36, 6e6: 48, 9e6: 72, 12e6: 96, 18e6: 144, 24e6: 192, 27e6: 216}
)
"""Data bits per OFDM symbol by bit rate [bit/s], 10 MHz channel spacing (IEEE 802.11-2020,
table 17-4)."""

LONGEST_FRAME: Final = 4095
"""What the LENGTH field of the SIGNAL field can express [byte] (IEEE 802.11-2020, 17.3.4.3)."""

_PREAMBLE: Final[Duration] = 32_000
_SIGNAL: Final[Duration] = 8_000
_SYMBOL: Final[Duration] = 8_000


def frame_duration(bitrate: float, size: int) -> Duration:
    r"""Time on air of a frame [ns] (IEEE 802.11-2020, 17.4.3, 10 MHz channel spacing).

    $$ T = 32 + 8 + 8 \lceil (16 + 8 size + 6) / N_{DBPS} \rceil \mu s $$

    Args:
        bitrate: one of `BITS_PER_SYMBOL` [bit/s].
        size: of the frame, headers included [byte].
    """
    bits = 16 + 8 * size + 6  # SERVICE, frame, tail
    return _PREAMBLE + _SIGNAL + _SYMBOL * math.ceil(bits / BITS_PER_SYMBOL[bitrate])
