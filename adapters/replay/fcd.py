"""SUMO's floating car data: the XML file of `--fcd-output`.

Persons who ride in a vehicle are no bodies of their own, and left out; so are containers.
https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html has the format.
"""

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from adapters.replay.findings import Findings, Place
from adapters.replay.snapshot import MOTION, SIZE, Cell, Snapshot, file_time, read_snapshot
from adapters.replay.xml_stream import Element, read_xml
from orchestrator.errors import Location
from orchestrator.timebase import Time

logger = logging.getLogger(__name__)

ROOT: Final = "fcd-export"

_TIME: Final = "timestep"
_VEHICLE: Final = "vehicle"
_PERSON: Final = "person"
_LOAD: Final = "container"
_PLACED: Final = ("x", "y", "angle", "speed")
_ATTRIBUTES: Final = {"heading": "angle"}
"""The names of attributes that are not those of columns."""

_UNTYPED: Final = {_PERSON: "DEFAULT_PEDTYPE"}
"""The types of those whose type the file leaves out."""


def read_fcd(path: Path, findings: Findings) -> Iterator[Snapshot]:
    """The snapshots of a file, in its order, with SUMO's angles and front bumpers.

    Args:
        path: of the file, which may be compressed (`*.gz`).
        findings: takes what is wrong with it.
    """
    reader = _Reader(path, findings)
    for _ in read_xml(path, findings, reader.start, reader.end):
        yield from reader.done
        reader.done.clear()
        if reader.is_foreign:
            return


class _Reader:
    """What is read of a file.

    Attributes:
        done: the snapshots that are complete.
        is_foreign: whether the file is something else.
    """

    def __init__(self, file: Path, findings: Findings) -> None:
        self._file = file
        self.done: list[Snapshot] = []
        self.is_foreign = False
        self._findings = findings
        self._time: Time | None = None
        self._place: Place = (1, 1)
        self._elements: list[Element] = []
        self._vehicle: Mapping[str, str] = {}
        self._has_loads = False

    def start(self, element: Element) -> None:
        """Take the start of an element."""
        if self.is_foreign:
            return
        tag, attributes = element.tag, element.attributes
        if element.parent == _TIME and tag == _VEHICLE:
            self._vehicle = attributes
            self._elements.append(element)
        elif element.parent == _TIME and tag == _PERSON:
            if not self._rides(attributes):
                self._elements.append(element)
        elif element.parent == _TIME and tag == _LOAD:
            self._leave_out(element)
        elif not element.parent:
            self.is_foreign = tag != ROOT
            if self.is_foreign:
                what = f"`<{tag}>` is not SUMO's FCD output, whose root is `<{ROOT}>`"
                self._findings.note(element.place, what)
        elif tag == _TIME and element.parent == ROOT:
            self._elements, self._vehicle = [], {}
            self._place = element.place
            self._time = file_time(attributes.get("time", ""))
            if self._time is None:
                shown = attributes.get("time")
                what = "is missing" if shown is None else f"is `{shown}`, no number of seconds"
                self._findings.note(element.place, f"`time` {what}")
        else:
            what = f"`<{tag}>` in `<{element.parent}>` is no element of SUMO's FCD output"
            self._findings.note(element.place, what)

    def end(self, tag: str) -> None:
        """Take the end of an element."""
        if tag == _TIME and self._time is not None:
            self.done.append(
                read_snapshot(
                    self._time,
                    self._cells(),
                    [element.place for element in self._elements],
                    self._findings,
                    place=self._place,
                    labels=_ATTRIBUTES,
                )
            )

    def _leave_out(self, load: Element) -> None:
        """Say once that there are loads."""
        if not self._has_loads:
            where, name = Location(str(self._file), *load.place), load.attributes.get("id", "")
            what = "%s: container `%s` is left out, and so are all others: loads are no road users"
            logger.info(what, where, name)
        self._has_loads = True

    def _rides(self, attributes: Mapping[str, str]) -> bool:
        """Whether a person is in a vehicle, and no body of its own.

        SUMO writes those in a vehicle right after it, with its position, angle and speed. Only if
        it was asked for the attribute does it also name the vehicle, or nothing.
        """
        named = attributes.get(_VEHICLE)
        if named is not None:
            return bool(named)
        before = self._vehicle
        return bool(before) and all(attributes.get(x) == before.get(x) for x in _PLACED)

    def _cells(self) -> dict[str, list[Cell]]:
        """The cells of this time by column."""
        rows = [element.attributes for element in self._elements]
        cells: dict[str, list[Cell]] = {
            column: [row.get(_ATTRIBUTES.get(column, column)) for row in rows]
            for column in ("id", *MOTION)
        }
        cells["key"] = [_key(element) for element in self._elements]
        cells["type"] = [
            element.attributes.get("type") or _UNTYPED.get(element.tag)
            for element in self._elements
        ]
        for column in SIZE:
            if any(column in row for row in rows):
                cells[column] = [row.get(column) for row in rows]
        return cells


def _key(element: Element) -> str:
    """What tells a road user from all others: vehicles and persons of SUMO may share a name."""
    name = element.attributes.get("id", "")
    return name if element.tag == _VEHICLE else f"{element.tag}\0{name}"
