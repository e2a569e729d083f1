"""The maps of the page of the readings: where one relay method beats another, and by how much."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from studies.method import records
from studies.method.text import markdown, shown
from studies.relay.advantage import Cell, Margin, by_row
from studies.relay.readings import MARGINS

MAPS: Final = {
    "relay_map_budget": """\
Tall vehicles over the link budget. At each exponent the queue has as many trucks as fit the direct
link at 13 % of tall vehicles: 4, 3, 3 and 3.
""",
    "relay_map_load": """\
Candidates over the load: the share of the vehicles that offer to relay, of some 45, and the time
between two BSMs of each radio.
""",
}
"""What each map shows, by the name of its experiment."""

_TITLE: Final = "## Where height and mobility beat signal strength"

_TEXT: Final = """\
Signal strength is by the own hop here, the power that the device that selects has by itself; by the
sum of both hops it delivers more, as the tables above say. Differences are by the same seeds, and
nothing is interpolated. Intervals are of 95 % each; *at once* counts those that also leave out 0
when all cells of a map are to hold together (Bonferroni).
"""

_MARGINS: Final = """\
By each factor alone: the mean of the cells over all levels of the other, by seed, and how it
differs from the first level, by the same seeds [points].
"""


def maps(folder: Path, link: str) -> list[str]:
    """The part of the page with the maps that were made.

    Args:
        folder: with what the reports wrote.
        link: the path of `folder` from the page.
    """
    parts = [part for name, text in MAPS.items() for part in _map(folder, link, name, text)]
    return [f"{_TITLE}\n\n{_TEXT}", *parts] if parts else []


def _map(folder: Path, link: str, name: str, text: str) -> list[str]:
    path = folder / f"{name}.csv"
    if not path.is_file():
        return []
    found = records.read(path, Cell)
    by_level = records.read(folder / f"{name}{MARGINS}.csv", Margin)
    tables = f"[{name}.csv]({link}/{name}.csv), [{name}{MARGINS}.csv]({link}/{name}{MARGINS}.csv)"
    return [
        f"![{name}]({link}/{name}.svg)\n",
        f"{text}\n{_counts(found)} The numbers: {tables}.\n",
        f"{_differences(found)}\n",
        f"{_rates(found)}\n",
        f"{_MARGINS}\n{_margins(by_level)}\n",
    ]


def _counts(found: Sequence[Cell]) -> str:
    """A sentence: in how many cells which method delivers more."""
    total = len(found)
    more, less = _ahead(found, 1)
    more_at_once, less_at_once = _ahead(found, total)
    return (
        f"MoHeD delivers more in {more} of {total} cells (at once: {more_at_once}), less in {less} "
        f"(at once: {less_at_once}); in {total - more - less}, which are hatched, the interval "
        "contains 0."
    )


def _ahead(found: Sequence[Cell], comparisons: int) -> tuple[int, int]:
    """Count the cells in which the first method surely delivers more, and those with less."""
    signs = [
        cell.difference.value > 0.0
        for cell in found
        if cell.difference is not None and cell.is_decided_among(comparisons)
    ]
    return sum(signs), len(signs) - sum(signs)


def _differences(found: Sequence[Cell]) -> str:
    head = "MoHeD minus signal strength, own hop [points]"
    return _grid(head, found, [shown(cell.difference, ".1f") for cell in found])


def _rates(found: Sequence[Cell]) -> str:
    return _grid("PRR of MoHeD, of signal strength [%]", found, [_both(cell) for cell in found])


def _both(cell: Cell) -> str:
    return ", ".join(
        "-" if rate is None else f"{100 * rate.value:.1f}" for rate in (cell.better, cell.worse)
    )


def _grid(head: str, found: Sequence[Cell], texts: Sequence[str]) -> str:
    """A table of one text per cell of a map."""
    columns = list(dict.fromkeys(cell.column for cell in found))
    width = len(columns)
    body = [
        [row, *texts[number * width : (number + 1) * width]]
        for number, row in enumerate(by_row(found))
    ]
    return markdown((head, *columns), body)


def _margins(found: Sequence[Margin]) -> str:
    head = ("factor", "level", "seeds", "MoHeD minus signal strength", "change from the first")
    body = [
        [
            margin.factor.replace("_", " "),
            margin.level,
            str(margin.n),
            shown(margin.difference, ".1f"),
            "" if margin.change is None else shown(margin.change, ".1f"),
        ]
        for margin in found
    ]
    return markdown(head, body)
