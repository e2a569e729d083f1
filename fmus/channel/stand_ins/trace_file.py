"""Recorded links in files: checked completely, all problems at once, each at its place.

docs/formats.md describes the files for those who write them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from fmus.channel.stand_ins.cells import CellReader
from fmus.channel.stand_ins.rows import LinkRows
from fmus.channel.stand_ins.table import Table, TableError, check_columns, read_table
from fmus.messages.records import LINKS, OUTCOMES
from orchestrator.errors import Problem
from orchestrator.timebase import Duration

Float: TypeAlias = npt.NDArray[np.float64]
Int: TypeAlias = npt.NDArray[np.int64]
Codes: TypeAlias = npt.NDArray[np.uint8]

KEYS: Final = ("time", "transmitter", "receiver")
"""Columns of both kinds of file."""

_DISPLAYED: Final = ("power_dbm", "snir_db", "link")
_LATEST: Final = 4e9  # twice that is the end of 64-bit nanoseconds [s]
_LONGEST_DELAY: Final = 1e3  # [s]
_OUTCOME_CODES: Final = {letter: code for code, letter in enumerate(OUTCOMES)}
_LINK_CODES: Final = {name: code for code, name in enumerate(LINKS)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Rows by link, then time, with what both kinds of file may say; shape (row,) each.

    Attributes:
        rows: finds rows by link and time.
        power_dbm: NaN where not known.
        snir_db: NaN where not known.
        link: indices into `LINKS`; LOS where not known.
    """

    rows: LinkRows
    power_dbm: Float
    snir_db: Float
    link: Codes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PerTrace:
    """Packet error rates of links over time.

    Attributes:
        samples: each holds until the next of its link.
        per: 0..1, shape (row,).
    """

    samples: Samples
    per: Float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OutcomeTrace:
    """What became of single frames.

    Attributes:
        samples: one per frame and receiver.
        outcome: indices into `OUTCOMES`, shape (row,).
        delay: from handing the frame to the radio to its reception [ns], shape (row,);
            `UNKNOWN_DELAY` where not known.
    """

    samples: Samples
    outcome: Codes
    delay: Int


UNKNOWN_DELAY: Final = -1


def read_trace(
    path: Path, names: Mapping[str, int], time_offset: Duration
) -> PerTrace | OutcomeTrace:
    """Read a file of recorded links; its columns tell which kind it is.

    Args:
        path: of the CSV or Parquet file.
        names: numbers of the vehicles that are named by text.
        time_offset: added to the times of the file [ns].

    Raises:
        TableError: all problems of the file.
        ComponentTypeError: it is a Parquet file, and the extra is not installed.
    """
    table = read_table(path)
    reading = _Reading(table, CellReader(table), names, time_offset)
    match "per" in table.columns, "outcome" in table.columns:
        case True, False:
            return reading.per_trace()
        case False, True:
            return reading.outcome_trace()
        case both, _:
            what = (
                f"has {'both' if both else 'neither'} of the columns `per` and `outcome`; it needs "
                "one: error rates of links over time, or outcomes of single frames"
            )
            raise TableError([Problem(table.place(None), what)])


def read_names(path: Path) -> Mapping[str, int]:
    """The numbers of vehicles by their names, from a file with the columns `name` and `id`.

    Raises:
        TableError: all problems of the file.
    """
    table = read_table(path)
    check_columns(table, ("name", "id"), ())
    cells = CellReader(table)
    numbers = cells.vehicles("id", {})
    found: dict[str, int] = {}
    for row, (name, number) in enumerate(zip(table.columns["name"], numbers.tolist(), strict=True)):
        if name is None:
            cells.add([row], "name", lambda _: "is empty")
        elif str(name) in found:
            cells.add([row], "name", lambda row: f"`{table.columns['name'][row]}` stands twice")
        found[str(name)] = number
    cells.finish()
    return found


@dataclass(frozen=True, slots=True)
class _Reading:
    """One reading of a table.

    Attributes:
        table: of the file.
        cells: reads it.
        names: numbers of vehicles.
        time_offset: added to the times [ns].
    """

    table: Table
    cells: CellReader
    names: Mapping[str, int]
    time_offset: Duration

    def per_trace(self) -> PerTrace:
        check_columns(self.table, (*KEYS, "per"), _DISPLAYED)
        per = self.cells.numbers("per", 0.0, 1.0)
        samples, order = self._samples(may_repeat=False)
        return PerTrace(samples=samples, per=per[order])

    def outcome_trace(self) -> OutcomeTrace:
        check_columns(self.table, (*KEYS, "outcome"), (*_DISPLAYED, "delay"))
        outcome = self.cells.codes("outcome", _OUTCOME_CODES).astype(np.uint8)
        delay = self.cells.optional_numbers("delay", 0.0, _LONGEST_DELAY)
        samples, order = self._samples(may_repeat=True)
        known = np.where(np.isnan(delay), UNKNOWN_DELAY, np.rint(np.nan_to_num(delay) * 1e9))
        return OutcomeTrace(
            samples=samples, outcome=outcome[order], delay=known.astype(np.int64)[order]
        )

    def _samples(self, *, may_repeat: bool) -> tuple[Samples, Int]:
        """What the common columns say, and the order of rows in it.

        Args:
            may_repeat: whether two rows of one link may have the same time.

        Raises:
            TableError: all problems of the file.
        """
        cells = self.cells
        times = cells.numbers("time", -_LATEST, _LATEST)
        transmitter = cells.vehicles("transmitter", self.names)
        receiver = cells.vehicles("receiver", self.names)
        power, snir = cells.optional_numbers("power_dbm"), cells.optional_numbers("snir_db")
        link = cells.optional_codes("link", _LINK_CODES, LINKS.index("LOS")).astype(np.uint8)
        to_itself = np.flatnonzero((transmitter == receiver) & (receiver >= 0)).tolist()
        cells.add(to_itself, "receiver", lambda _: "is the transmitter itself")
        order = np.lexsort((receiver, transmitter))  # stable: within a link as in the file
        if not cells.has_problems:
            link_of_row = np.stack([transmitter, receiver], axis=1)
            self._check_times(order, times, link_of_row, may_repeat=may_repeat)
        cells.finish()
        ticks = np.rint(times * 1e9).astype(np.int64) + self.time_offset
        rows = LinkRows(ticks[order], transmitter[order], receiver[order])
        return (
            Samples(rows=rows, power_dbm=power[order], snir_db=snir[order], link=link[order]),
            order,
        )

    def _check_times(self, order: Int, times: Float, links: Int, *, may_repeat: bool) -> None:
        """Note rows whose time does not follow that of the row of the same link before."""
        before, row = order[:-1], order[1:]
        same = (links[before] == links[row]).all(axis=1)
        step = times[row] - times[before]
        is_wrong = same & ((step < 0.0) if may_repeat else (step <= 0.0))
        former = dict(zip(row[is_wrong].tolist(), before[is_wrong].tolist(), strict=True))
        self.cells.add(
            sorted(former),
            "time",
            lambda row: (
                f"{times[row]:g} s does not follow the {times[former[row]]:g} s of this link in "
                f"line {self.table.lines[former[row]]}; the times of a link ascend"
            ),
        )
