"""Units as FMI wants them: exponents of the SI base units and a factor."""

from dataclasses import dataclass, field
from typing import Final


@dataclass(frozen=True, slots=True)
class UnitDefinition:
    """A unit of measurement, in terms of the SI base units.

    Attributes:
        exponents: by the name of the SI base unit (or `rad`); `None` for a logarithmic unit,
            which FMI cannot relate to base units.
        factor: how many of the base units it is, e.g. 1000 for km.
    """

    exponents: dict[str, int] | None = field(default_factory=dict)
    factor: float = 1.0


UNITS: Final = {
    "1": UnitDefinition(),
    "%": UnitDefinition({}, 0.01),
    "m": UnitDefinition({"m": 1}),
    "mm": UnitDefinition({"m": 1}, 1e-3),
    "km": UnitDefinition({"m": 1}, 1e3),
    "m^2": UnitDefinition({"m": 2}),
    "s": UnitDefinition({"s": 1}),
    "ms": UnitDefinition({"s": 1}, 1e-3),
    "us": UnitDefinition({"s": 1}, 1e-6),
    "ns": UnitDefinition({"s": 1}, 1e-9),
    "Hz": UnitDefinition({"s": -1}),
    "kHz": UnitDefinition({"s": -1}, 1e3),
    "MHz": UnitDefinition({"s": -1}, 1e6),
    "GHz": UnitDefinition({"s": -1}, 1e9),
    "1/s": UnitDefinition({"s": -1}),
    "m/s": UnitDefinition({"m": 1, "s": -1}),
    "km/h": UnitDefinition({"m": 1, "s": -1}, 1 / 3.6),
    "m/s^2": UnitDefinition({"m": 1, "s": -2}),
    "rad": UnitDefinition({"rad": 1}),
    "deg": UnitDefinition({"rad": 1}, 0.017453292519943295),
    "rad/s": UnitDefinition({"rad": 1, "s": -1}),
    "kg": UnitDefinition({"kg": 1}),
    "N": UnitDefinition({"kg": 1, "m": 1, "s": -2}),
    "J": UnitDefinition({"kg": 1, "m": 2, "s": -2}),
    "W": UnitDefinition({"kg": 1, "m": 2, "s": -3}),
    "mW": UnitDefinition({"kg": 1, "m": 2, "s": -3}, 1e-3),
    "K": UnitDefinition({"K": 1}),
    "V": UnitDefinition({"kg": 1, "m": 2, "s": -3, "A": -1}),
    "A": UnitDefinition({"A": 1}),
    "byte": UnitDefinition({}, 8.0),
    "bit": UnitDefinition(),
    "bit/s": UnitDefinition({"s": -1}),
    "Mbit/s": UnitDefinition({"s": -1}, 1e6),
    "dB": UnitDefinition(None),
    "dBi": UnitDefinition(None),
    "dBm": UnitDefinition(None),
    "dB/m": UnitDefinition(None),
}
