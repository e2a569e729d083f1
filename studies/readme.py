"""The tables of results in the README, from the committed results of the studies.

`python -m studies.readme README.md docs/results` writes them into the file. A table is known by its
head; the text around it is by hand.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from orchestrator import tables
from studies.collision.conditions import COOPERATIVE
from studies.collision.runs import CONSTANT_PER, LOAD, POLICIES, RELAY
from studies.collision.statistics import Result as Driven
from studies.method import records
from studies.method.text import percent_shown
from studies.relay.statistics import Result as Relayed

METHODS: Final = {
    "mohed": "MoHeD",
    "signal-strength": "strongest signals",
    "random": "random",
    "direct": "none: direct link",
}
"""Rows of the table of relay methods, and what readers call them."""

COMPRESSION: Final = 32
SPEED_KMH: Final = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row of the table of collisions: the runs under one condition of one experiment.

    Attributes:
        title: what the ego vehicle drives by.
        experiment: the name of the experiment.
        relay: the relay method.
        policy: the driving policy; if it is cooperative, of `COMPRESSION`.
        per: the packet error rate that is set; `None` if it is measured.
        granularity: what is lost when a packet is: see the experiment.
        load: whether a packet stands for a message (`probe`), or all are sent (`full`).
    """

    title: str
    experiment: str
    relay: str = "direct"
    policy: str = COOPERATIVE
    per: float | None = None
    granularity: str = "frame"
    load: str = "probe"

    def of(self, results: Sequence[Driven]) -> Driven:
        """The one of `results` that it shows.

        Raises:
            ValueError: there is none, or there are several.
        """
        found = [each for each in results if self._shows(each)]
        if len(found) != 1:
            raise ValueError(f"`{self.title}` is {len(found)} rows of the results, not one")
        return found[0]

    def _shows(self, result: Driven) -> bool:
        return (
            result.experiment == self.experiment
            and result.relay == self.relay
            and result.policy == self.policy
            and result.compression == (COMPRESSION if self.policy == COOPERATIVE else None)
            and result.speed_kmh == SPEED_KMH
            and (self.per is None or result.per == self.per)
            and result.granularity == self.granularity
            and result.load == self.load
        )


ROWS: Final = (
    Row(title="its own sensors: blind network (*)", experiment=POLICIES, policy="blind"),
    Row(title="all packets", experiment=POLICIES),
    Row(title="MoHeD", experiment=RELAY, relay="mohed"),
    Row(title="the direct link", experiment=RELAY),
    Row(title="constant PER", experiment=CONSTANT_PER, per=0.6),
    Row(title="constant PER", experiment=CONSTANT_PER, per=0.8),
    Row(
        title="MoHeD, real messages: 24 packets each, all needed",
        experiment=LOAD,
        relay="mohed",
        granularity="packets",
        load="full",
    ),
)


def relays(folder: Path) -> list[str]:
    """The table of relay methods at the condition of the paper's Table II, as lines of Markdown.

    Raises:
        FileNotFoundError: the study was not run.
        ValueError: a file is not what a report wrote.
    """
    found = {row.method: row for row in records.read(folder / "table2.csv", Relayed)}
    body = []
    for method, title in METHODS.items():
        row = found[method]
        paper = "" if row.paper_prr is None else f"{100 * row.paper_prr:.2f}"
        regret = "" if row.regret is None else f"{100 * row.regret.value:.1f}"
        body.append((title, percent_shown(row.prr), paper, regret))
    return _table(("relay", "PRR [%], 95 % interval", "paper", "regret [points]"), body)


def collisions(folder: Path) -> list[str]:
    """The table of collision rates of the network, as lines of Markdown.

    Raises:
        FileNotFoundError: the study was not run.
        ValueError: a file is not what a report wrote, or lacks a row.
    """
    results = records.read(folder / "collision.csv", Driven)
    body = []
    for row in ROWS:
        found = row.of(results)
        by_packets = row.policy == COOPERATIVE and found.per is not None
        per = f"{100 * (found.per or 0.0):.0f}" if by_packets else ""
        body.append((row.title, per, percent_shown(found.collision_rate, ".3g")))
    what = f"the ego drives by ({SPEED_KMH:.0f} km/h, compression {COMPRESSION})"
    return _table((what, "PER [%]", "collisions [%], 95 % interval"), body)


def with_tables(text: str, made: Sequence[Sequence[str]]) -> str:
    """`text` with the tables `made` in the places of those that have the same heads.

    Raises:
        ValueError: the text does not have exactly one table with one of the heads.
    """
    lines = text.splitlines()
    for table in made:
        places = [number for number, line in enumerate(lines) if line == table[0]]
        if len(places) != 1:
            raise ValueError(f"there are {len(places)} tables with the head `{table[0]}`, not one")
        begin = places[0]
        end = begin + sum(1 for _ in _rows(lines[begin:]))
        lines[begin:end] = table
    return "\n".join(lines) + "\n"


def _rows(lines: Sequence[str]) -> Iterator[str]:
    for line in lines:
        if not line.startswith("|"):
            return
        yield line


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    return tables.markdown(tables.left(*head), body, tables.CLOSE)


def main() -> None:
    """Write the tables into the README."""
    parser = argparse.ArgumentParser(prog="python -m studies.readme")
    parser.add_argument("readme", type=Path, help="the file whose tables are written")
    parser.add_argument("directory", type=Path, help="what the reports of the studies wrote")
    given = parser.parse_args()
    try:
        made = (relays(given.directory), collisions(given.directory))
        text = with_tables(given.readme.read_text(encoding="utf-8"), made)
    except FileNotFoundError as error:
        parser.error(f"there is no `{error.filename}`; `make paper` writes it")
    except ValueError as error:
        parser.error(str(error))
    given.readme.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
