"""The unit symbols that scenario files and connectors may use, as data.

A unit is a factor and the exponents of base units, as FMI's unit definitions are (FMI 3.0.2,
section 2.4.3), with two base units more: `bit`, so that a data rate is not a frequency, and
`dB`, because a gain is a ratio of powers to one reader and of voltages to another. Values are
those of the SI Brochure, 9th edition, tables 2, 4, 5, 7 and 8.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

BASE_UNITS: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "bit", "dB")
"""The base units in the order of `Exponents`; the first eight are those of FMI."""

Exponents = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Symbol:
    """What one symbol stands for.

    Attributes:
        factor: the value in base units of one of it.
        exponents: one per base unit.
        offset: the value in base units of zero of it (degree Celsius).
        takes_prefix: whether `k`, `m`, ... may stand before it.
        reference: for the level of a power, the power in base units at level 0 [W].
    """

    factor: Fraction
    exponents: Exponents
    offset: Fraction = Fraction(0)
    takes_prefix: bool = False
    reference: Fraction | None = None


def exponents(**powers: int) -> Exponents:
    """Exponents by name, e.g. `exponents(m=1, s=-2)`."""
    return tuple(powers.get(name, 0) for name in BASE_UNITS)


PURE: Final = exponents()
_POWER: Final = exponents(kg=1, m=2, s=-3)
_DEGREE: Final = Fraction(math.pi) / 180  # 180 deg convert to the float nearest to pi

PREFIXES: Final = {
    "Q": 30, "R": 27, "Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3,
    "h": 2, "da": 1, "d": -1, "c": -2, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9, "p": -12,
    "f": -15, "a": -18, "z": -21, "y": -24, "r": -27, "q": -30,
}  # fmt: skip
"""Powers of ten by prefix; `u` and both code points of the Greek letter are micro."""


def _si(factor: str | Fraction | int, **powers: int) -> Symbol:
    return Symbol(Fraction(factor), exponents(**powers), takes_prefix=True)


def _other(factor: str | Fraction | int, **powers: int) -> Symbol:
    return Symbol(Fraction(factor), exponents(**powers))


def _level(reference: str) -> Symbol:
    return Symbol(Fraction(1), _POWER, reference=Fraction(reference))


SYMBOLS: Final = {
    "m": _si(1, m=1),
    "g": _si("1e-3", kg=1),
    "s": _si(1, s=1),
    "A": _si(1, A=1),
    "K": _si(1, K=1),
    "mol": _si(1, mol=1),
    "cd": _si(1, cd=1),
    "rad": _si(1, rad=1),
    "bit": _si(1, bit=1),
    "B": _si(8, bit=1),
    "Hz": _si(1, s=-1),
    "N": _si(1, kg=1, m=1, s=-2),
    "Pa": _si(1, kg=1, m=-1, s=-2),
    "J": _si(1, kg=1, m=2, s=-2),
    "W": _si(1, kg=1, m=2, s=-3),
    "C": _si(1, A=1, s=1),
    "V": _si(1, kg=1, m=2, s=-3, A=-1),
    "F": _si(1, kg=-1, m=-2, s=4, A=2),
    "Ohm": _si(1, kg=1, m=2, s=-3, A=-2),
    "S": _si(1, kg=-1, m=-2, s=3, A=2),
    "Wb": _si(1, kg=1, m=2, s=-2, A=-1),
    "T": _si(1, kg=1, s=-2, A=-1),
    "H": _si(1, kg=1, m=2, s=-2, A=-2),
    "l": _si("1e-3", m=3),
    "L": _si("1e-3", m=3),
    "t": _si(1000, kg=1),
    "eV": _si("1.602176634e-19", kg=1, m=2, s=-2),
    "bar": _si(100_000, kg=1, m=-1, s=-2),
    "min": _other(60, s=1),
    "h": _other(3600, s=1),
    "d": _other(86_400, s=1),
    "ha": _other(10_000, m=2),
    "deg": _other(_DEGREE, rad=1),
    "°": _other(_DEGREE, rad=1),
    "rev": _other(2 * Fraction(math.pi), rad=1),
    "degC": Symbol(Fraction(1), exponents(K=1), offset=Fraction("273.15")),
    "%": _other("1e-2"),
    "dB": _other(1, dB=1),
    "dBi": _other(1, dB=1),
    "dBm": _level("1e-3"),
    "dBW": _level("1"),
}

QUANTITIES: Final = {
    PURE: "a pure number",
    exponents(m=1): "a length",
    exponents(m=2): "an area",
    exponents(m=3): "a volume",
    exponents(kg=1): "a mass",
    exponents(s=1): "a time",
    exponents(s=-1): "a frequency",
    exponents(m=1, s=-1): "a speed",
    exponents(m=1, s=-2): "an acceleration",
    exponents(rad=1): "an angle",
    exponents(rad=1, s=-1): "an angular speed",
    exponents(K=1): "a temperature",
    exponents(A=1): "a current",
    exponents(kg=1, m=1, s=-2): "a force",
    exponents(kg=1, m=-1, s=-2): "a pressure",
    exponents(kg=1, m=2, s=-2): "an energy",
    _POWER: "a power",
    exponents(kg=1, m=2, s=-3, A=-1): "a voltage",
    exponents(bit=1): "an amount of data",
    exponents(bit=1, s=-1): "a data rate",
    exponents(dB=1): "a gain or loss",
    exponents(dB=1, m=-1): "an attenuation per length",
}
"""Names of quantities, for error messages."""

FREQUENT: Final = (
    "ms", "us", "ns", "km", "mW", "kHz", "MHz", "GHz", "km/h", "m/s", "m/s2", "rad/s", "deg/s",
    "dB/m", "dB/km", "bit/s", "kbit/s", "Mbit/s", "Gbit/s", "MB/s", "1/m", "1/s",
)  # fmt: skip
"""Offered first when a unit cannot be read."""

OFTEN_WRITTEN: Final = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "millis": "ms",
    "minutes": "min", "hours": "h", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "degree": "deg", "degrees": "deg", "percent": "%", "kph": "km/h", "kmh": "km/h",
    "mps": "m/s", "hertz": "Hz", "watt": "W", "bps": "bit/s", "kbps": "kbit/s",
    "mbps": "Mbit/s", "gbps": "Gbit/s", "byte": "B", "bytes": "B", "celsius": "degC",
}  # fmt: skip
"""What people write for units that exist, in lower case; only offered, never accepted."""
