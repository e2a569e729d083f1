r"""Error rates of IEEE 802.11p at 6 Mbit/s: QPSK with code rate 1/2, in channels of 10 MHz.

The NIST model (G. Pei and T. R. Henderson, Validation of OFDM error rate model in ns-3, 2010): bits
of a coherent receiver in white noise are wrong with the probability p of their modulation, and
decoding ends in error with a union bound of

$$ P_u = \frac{1}{2} \sum_{d=10,12,\dots} a_d D^d, \quad D = \sqrt{4 p (1 - p)}, $$

with the weight spectrum $a_d$ of the convolutional code. It is the model of the channel FMU.
"""

import math
from typing import Final

_RATE_1_2: Final = (36, 211, 1404, 11633, 77433, 502690, 3322763, 21292910, 134365911)
"""Weight spectrum of the convolutional code (133, 171), from D^10 on in steps of D^2."""
_SIGNAL_BITS: Final = 24
"""Bits of the header (IEEE 802.11-2020, 17.3.4), in BPSK."""
_SERVICE_AND_TAIL: Final = 22
"""Bits of the payload beside those of the packet (IEEE 802.11-2020, 17.3.2)."""


def frame_success(snr_db: float, frame_size: int) -> float:
    """The probability that white noise spares a frame at 6 Mbit/s, its header and its payload.

    Args:
        snr_db: signal to noise ratio [dB].
        frame_size: of the packet with MAC and LLC [byte].
    """
    snr = 10.0 ** (snr_db / 10.0)
    header = _bits_success(0.5 * math.erfc(math.sqrt(snr)), _SIGNAL_BITS)
    bits = _SERVICE_AND_TAIL + 8 * frame_size
    return header * _bits_success(0.5 * math.erfc(math.sqrt(snr / 2.0)), bits)


def _bits_success(error: float, bits: int) -> float:
    """The probability that so many bits, coded with rate 1/2, are decoded.

    Args:
        error: the probability that a bit is wrong before decoding.
        bits: how many.
    """
    square = 4.0 * error * (1.0 - error)
    union = 0.5 * sum(a * square ** (5 + k) for k, a in enumerate(_RATE_1_2))
    return math.exp(bits * math.log1p(-union)) if union < 1.0 else 0.0
