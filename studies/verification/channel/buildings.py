"""`building_shadowing.json`: loss by buildings, of links through scenes of polygons.

In a golden file each building has its own loss per wall and per metre; in the channel there is
one of each. The buildings of one kind are therefore given to an instance of their own, without the
others, and the losses of all kinds are added: that is exact, for losses of buildings add up.

Cases in which Veins stops on an assertion have no golden result, and cases of the category
`degenerate` (a link exactly through a corner, along a wall, or with an end exactly on it) are luck
of rounding there. From the channel they ask for a finite loss only.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.json_document import Node, read_json
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import LOSS, Tolerance

NAME: Final = "building_shadowing.json"
DEGENERATE: Final = "degenerate"
_ASSERT: Final = "veins_assert"


@dataclass(frozen=True, slots=True)
class Kind:
    """What a building costs."""

    wall_loss: float
    indoor_loss: float


@dataclass(frozen=True, slots=True)
class _Scene:
    category: str
    rings: Mapping[Kind, Sequence[Sequence[float]]]
    links: Mapping[str, Array]
    golden: Array  # [dB]; NaN where Veins asserts
    places: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BuildingCheck(Check):
    """The scenes of the file."""

    scenes: tuple[_Scene, ...]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return LOSS

    @property
    @override
    def work(self) -> int:
        return len(self._kinds())

    def _kinds(self) -> list[Kind]:
        return list(dict.fromkeys(kind for one in self.scenes for kind in one.rings))

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        losses = [np.zeros(len(one.golden)) for one in self.scenes]
        for kind in self._kinds():
            concerned = [k for k, one in enumerate(self.scenes) if kind in one.rings]
            self._add_losses(channel, kind, concerned, losses)
            progress.advance()
        return self._compared(losses)

    def _add_losses(
        self, channel: ChannelUnderTest, kind: Kind, concerned: Sequence[int], losses: list[Array]
    ) -> None:
        """Add what buildings of this kind cost, in the scenes that have any."""
        parameters = {
            "model": "veins",
            "wall_loss": kind.wall_loss,
            "indoor_loss": kind.indoor_loss,
        }
        with channel.start(parameters, {}) as session:
            for k in concerned:
                one = self.scenes[k]
                session.step({**scene.buildings(one.rings[kind]), **one.links})
                losses[k] += session.probed("building_loss")

    def _compared(self, losses: Sequence[Array]) -> Comparison:
        found: dict[str, list[tuple[str, float, float]]] = defaultdict(list)
        excepted: list[tuple[str, float, float]] = []
        for one, ours in zip(self.scenes, losses, strict=True):
            for case in zip(one.places, one.golden.tolist(), ours.tolist(), strict=True):
                is_excepted = math.isnan(case[1]) or one.category == DEGENERATE
                (excepted if is_excepted else found[one.category]).append(case)
        infinite = [f"{p}: ours is {ours}" for p, _, ours in excepted if not math.isfinite(ours)]
        return Comparison.of_values(
            LOSS,
            [place for rows in found.values() for place, _, _ in rows],
            [
                Series(
                    label=category,
                    golden=np.array([golden for _, golden, _ in rows]),
                    ours=np.array([ours for _, _, ours in rows]),
                )
                for category, rows in found.items()
            ],
            excepted=len(excepted),
            mismatches=len(infinite),
            notes=infinite,
            details={
                "veins_asserts": sum(math.isnan(golden) for _, golden, _ in excepted),
                "excepted_but_equal": sum(
                    abs(golden - ours) <= LOSS.limit for _, golden, ours in excepted
                ),
            },
        )


def read(path: Path) -> BuildingCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    return BuildingCheck(tuple(map(_scene, read_json(path, NAME).filled())))


def _scene(node: Node) -> _Scene:
    rings: dict[Kind, list[Any]] = defaultdict(list)
    for obstacle in node["obstacles"]:
        kind = Kind(obstacle["db_per_cut"].number(), obstacle["db_per_meter"].number())
        rings[kind].append(_ring(obstacle["shape"]))
    queries = list(node["queries"])
    return _Scene(
        category=node["category"].text(),
        rings=rings,
        links=scene.links(
            [query["tx"].numbers(3) for query in queries],
            [query["rx"].numbers(3) for query in queries],
        ),
        golden=np.array([_loss(query) for query in queries]),
        places=tuple(f"{NAME}: {query.place} (id {_shown(query)})" for query in queries),
    )


def _ring(node: Node) -> list[list[float]]:
    corners = [corner.numbers(2) for corner in node]
    if len(corners) < 3:
        raise node.problem(f"a building has 3 corners at least, not {len(corners)}")
    return corners


def _loss(query: Node) -> float:
    status = query["status"].text()
    if status == _ASSERT:
        return float("nan")
    if status != "ok":
        raise query["status"].problem(f"`{status}` is not known; there are: ok, {_ASSERT}")
    return query["loss_db"].number()


def _shown(query: Node) -> str:
    return str(query["id"].value) if "id" in query else "?"
