"""Headings of columns: a name and a unit, `speed [km/h]`, `force[2] [N]`."""

import re
from dataclasses import dataclass
from typing import Final

from orchestrator.units import UnitError, parse_unit

_NAME: Final = r"[^\[\]]*[^\[\]\s](?:\[[0-9, ]+\])?"
_HEADING: Final = re.compile(rf"\s*(?P<name>{_NAME})\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*")


@dataclass(frozen=True, slots=True)
class Heading:
    """The name of a column, and the unit of its numbers; `1` for pure numbers."""

    name: str
    unit: str

    @classmethod
    def parse(cls, text: str) -> "Heading":
        """Read a heading.

        Raises:
            ValueError: it has no name, or its unit does not exist.
        """
        match = _HEADING.fullmatch(text)
        if match is None:
            what = "is no name" if text.strip() else "a column has no name"
            raise ValueError(f"`{text}` {what}; write `speed [km/h]`" if text.strip() else what)
        unit = (match["unit"] or "1").strip() or "1"
        try:
            parse_unit(unit)
        except UnitError as error:
            raise ValueError(f"`{match['name']}`: {error}") from None
        return cls(match["name"], unit)
