"""What an FMU says of its units (FMI 2.0.4, section 2.2.2; FMI 3.0.2, section 2.4.3)."""

from collections.abc import Iterator, Mapping
from typing import Final
from xml.etree import ElementTree as ET

from orchestrator.exact import exact
from orchestrator.unit_table import exponents
from orchestrator.units import Unit

_BASE: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def read_definitions(root: ET.Element) -> Mapping[str, Unit]:
    """The units that have a sound `BaseUnit`, by name; without one, FMI knows no conversion.

    Args:
        root: of modelDescription.xml.
    """
    return dict(_definitions(root))


def _definitions(root: ET.Element) -> Iterator[tuple[str, Unit]]:
    for unit in root.iterfind("UnitDefinitions/Unit"):
        base, name = unit.find("BaseUnit"), unit.get("name")
        if base is None or name is None:
            continue
        try:
            powers = {symbol: int(base.get(symbol, "0")) for symbol in _BASE}
            factor, offset = (exact(base.get(k, d)) for k, d in (("factor", "1"), ("offset", "0")))
        except ValueError:
            continue
        if factor:
            yield name, Unit(name, factor, exponents(**powers), offset)
