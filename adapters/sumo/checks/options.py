"""The options that SUMO knows: names, synonyms and types.

`options.txt` has one line per option: its type, its name and its synonyms, as
`sumo --save-template` of SUMO 1.28 writes them; a line `SECTION` names a group of options.
"""

import importlib.resources
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Final

from orchestrator.timebase import NANOSECONDS_PER_SECOND, Time

INPUTS: Final = frozenset(
    {
        "net-file",
        "route-files",
        "additional-files",
        "weight-files",
        "load-state",
        "fcd-output.filter-edges.input-file",
        "device.ssm.filter-edges.input-file",
        "astar.all-distances",
        "astar.landmark-distances",
        "device.fcd-replay.files",
        "gui-settings-file",
        "edgedata-files",
        "alternative-net-file",
        "selection-file",
    }
)
"""Options that name files, or lists of files, that SUMO reads."""

_NO_OUTPUTS: Final = frozenset({"configuration-file", "phemlight-path"})
_OUTPUTS_TYPED_AS_TEXT: Final = frozenset({"device.ssm.file", "device.toc.file"})
_TRUTHS: Final = frozenset(
    {"true", "false", "1", "0", "yes", "no", "on", "off", "x", "t", "f", "-"}
)


@dataclass(frozen=True, slots=True)
class Option:
    """One option of SUMO.

    Attributes:
        type: `BOOL`, `INT`, `FLOAT`, `TIME`, `STR`, `FILE`, or a list of these (`STR[]`).
    """

    name: str
    type: str

    @property
    def is_input(self) -> bool:
        """Whether it names files that SUMO reads."""
        return self.name in INPUTS

    @property
    def is_output(self) -> bool:
        """Whether it names a file that SUMO writes."""
        is_file = self.type == "FILE" and self.name not in INPUTS | _NO_OUTPUTS
        return is_file or self.name in _OUTPUTS_TYPED_AS_TEXT

    def problem(self, value: str) -> str | None:
        """What is wrong with a value; `None` if it can be one, as far as the type tells."""
        match self.type:
            case "BOOL":
                is_right, expected = value.lower() in _TRUTHS, "`true` or `false`"
            case "INT":
                is_right, expected = _is_whole(value), "a whole number"
            case "FLOAT":
                is_right, expected = _is_number(value), "a number"
            case "TIME":
                is_right = time(value) is not None
                expected = "seconds, or `[days:]hours:minutes:seconds`"
            case _:
                return None
        return None if is_right else f"`{self.name}` is {expected}, got `{value}`"


@cache
def options() -> Mapping[str, Option]:
    """Every option, by its name and by each synonym."""
    found: dict[str, Option] = {}
    for kind, name, *synonyms in _lines():
        if kind != _SECTION:
            found |= dict.fromkeys((name, *synonyms), Option(name, kind))
    return MappingProxyType(found)


@cache
def sections() -> frozenset[str]:
    """The names of the groups that options may stand in."""
    return frozenset(name for kind, name, *_ in _lines() if kind == _SECTION)


def time(text: str) -> Time | None:
    """A time as SUMO writes it, in seconds or as `[days:]hours:minutes:seconds` [ns].

    `None` if it is none.
    """
    sign, digits = (-1, text[1:]) if text.startswith("-") else (1, text)
    parts = digits.split(":")
    if len(parts) not in {1, 3, 4} or not all(map(_is_number, parts)):
        return None
    factors = (86_400, 3_600, 60, 1)[-len(parts) :]
    total = sum(Fraction(part) * factor for part, factor in zip(parts, factors, strict=True))
    return sign * round(total * NANOSECONDS_PER_SECOND)


_SECTION: Final = "SECTION"


def _lines() -> list[list[str]]:
    table = importlib.resources.files(__package__).joinpath("options.txt")
    return [line.split() for line in table.read_text(encoding="utf-8").splitlines()]


def _is_whole(text: str) -> bool:
    return text.removeprefix("-").isdecimal()


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
