"""SUMO's floating car data: the XML file of `--fcd-output`.

https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html has the format.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from adapters.replay.findings import Findings, Place
from adapters.replay.snapshot import MOTION, SIZE, Cell, Snapshot, file_time, read_snapshot
from adapters.replay.xml_stream import Element, read_xml
from orchestrator.timebase import Time

ROOT: Final = "fcd-export"

_TIME: Final = "timestep"
_ROAD_USERS: Final = frozenset({"vehicle", "person", "container"})
_ATTRIBUTES: Final = {"heading": "angle"}
"""Of the columns that SUMO calls otherwise."""

_UNTYPED: Final = {"person": "DEFAULT_PEDTYPE", "container": "DEFAULT_CONTAINERTYPE"}
"""The types of those whose type the file leaves out."""


def read_fcd(path: Path, findings: Findings) -> Iterator[Snapshot]:
    """The snapshots of a file, in its order, with SUMO's angles and front bumpers.

    Args:
        path: of the file, which may be compressed (`*.gz`).
        findings: takes what is wrong with it.
    """
    reader = _Reader(findings)
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

    def __init__(self, findings: Findings) -> None:
        self.done: list[Snapshot] = []
        self.is_foreign = False
        self._findings = findings
        self._time: Time | None = None
        self._place: Place = (1, 1)
        self._begin()

    def _begin(self) -> None:
        self._cells: dict[str, list[Cell]] = {
            column: [] for column in ("id", "type", *MOTION, *SIZE)
        }
        self._places: list[Place] = []

    def start(self, element: Element) -> None:
        """Take the start of an element."""
        if self.is_foreign:
            return
        tag, attributes = element.tag, element.attributes
        if not element.path:
            self.is_foreign = tag != ROOT
            if self.is_foreign:
                what = f"`<{tag}>` is not SUMO's FCD output, whose root is `<{ROOT}>`"
                self._findings.note(element.place, what)
        elif tag == _TIME and len(element.path) == 1:
            self._begin()
            self._place = element.place
            self._time = file_time(attributes.get("time", ""))
            if self._time is None:
                shown = attributes.get("time")
                what = "is missing" if shown is None else f"is `{shown}`, no number of seconds"
                self._findings.note(element.place, f"`time` {what}")
        elif tag in _ROAD_USERS and element.path[-1] == _TIME:
            if not attributes.get("vehicle"):  # else it rides in that vehicle
                self._add(element)
        else:
            what = f"`<{tag}>` in `<{element.path[-1]}>` is no element of SUMO's FCD output"
            self._findings.note(element.place, what)

    def end(self, tag: str) -> None:
        """Take the end of an element."""
        if tag == _TIME and self._time is not None:
            self.done.append(
                read_snapshot(
                    self._time,
                    self._cells,
                    self._places,
                    self._findings,
                    place=self._place,
                    labels=_ATTRIBUTES,
                )
            )

    def _add(self, element: Element) -> None:
        attributes, cells = element.attributes, self._cells
        self._places.append(element.place)
        cells["id"].append(attributes.get("id"))
        cells["type"].append(attributes.get("type") or _UNTYPED.get(element.tag))
        for column in MOTION:
            cells[column].append(attributes.get(_ATTRIBUTES.get(column, column)))
        for column in SIZE:
            cells[column].append(attributes.get(column))
