"""What predicted trajectories are worth to MoHeD, scene by scene: a part of the page."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

from studies.method.estimates import Sample, differences, mean_of
from studies.method.text import markdown, percent_shown, shown
from studies.relay.reading_table import (
    AHEAD,
    FORESIGHT,
    READINGS,
    SCENES,
    Runs,
    Where,
    base,
    policy,
)

_METHOD: Final = "mohed-trajectories"

_TEXT: Final = """\
The paper's discussion credits MoHeD with predicting trajectories, its equations weigh obstacles
of the moment. *Trajectories*: MoHeD with the mean risk over the window along predicted trajectories
([how](physics-relay.md#mohed)); PRR in %, differences in points, by the same seeds. *Switches*: how
many more changes of the relay.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A scene, and which runs are compared there.

    Attributes:
        name: of the scene.
        ahead: MoHeD with predicted trajectories.
        mohed: MoHeD with the risk of now.
        total, own: signal strength by the sum of both hops, and by the own hop.
    """

    name: str
    ahead: Where
    mohed: Where
    total: Where
    own: Where


def places() -> Iterator[Place]:
    """The scene of Table II, and the others of the readings."""
    yield Place(
        name="as in the study",
        ahead=Where(FORESIGHT, {"method": _METHOD}),
        mohed=base("mohed"),
        total=base("signal-strength"),
        own=policy("one hop", "signal-strength-own"),
    )
    for total, own in pairwise(READINGS):
        if total.strength.table == SCENES:
            yield Place(
                name=total.name,
                ahead=Where(AHEAD, {"scene": total.name, "method": _METHOD}),
                mohed=total.mohed,
                total=total.strength,
                own=own.strength,
            )


def part(folder: Path) -> list[str]:
    """The part of the page, if there are runs.

    Args:
        folder: with the tables of runs.
    """
    runs = Runs(folder)
    rows = [row for place in places() if (row := _row(runs, place))]
    head = (
        "scene", "runs", "MoHeD", "trajectories", "trajectories minus MoHeD", "switches",
        "minus strength, sum", "minus strength, own hop",
    )  # fmt: skip
    return [f"## With predicted trajectories\n\n{_TEXT}\n{markdown(head, rows)}\n"] if rows else []


def _row(runs: Runs, place: Place) -> list[str]:
    """A row of the table; empty if a method was not run there."""
    wheres = (place.ahead, place.mohed, place.total, place.own)
    every = [runs.sample(where, "prr") for where in wheres]
    common = sorted(set.intersection(*map(set, every)))
    if not common:
        return []
    ahead, mohed, total, own = ({seed: one[seed] for seed in common} for one in every)
    more = [_among(runs.sample(where, "relay_switches"), common) for where in wheres[:2]]
    changes = mean_of(differences(*more))
    return [
        place.name,
        str(len(common)),
        percent_shown(mean_of(list(mohed.values()))),
        percent_shown(mean_of(list(ahead.values()))),
        percent_shown(mean_of(differences(ahead, mohed))),
        shown(changes, ".2f"),
        percent_shown(mean_of(differences(ahead, total))),
        percent_shown(mean_of(differences(ahead, own))),
    ]


def _among(found: Sample, seeds: list[int]) -> Sample:
    return {seed: found[seed] for seed in seeds if seed in found}
