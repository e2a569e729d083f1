"""`vehicle_shadowing.json`: loss by vehicle bodies, of links over scenes of vehicles.

The number of a vehicle is its place in the list, which is the order of registration in Veins: of
two edges at exactly the same distance only the first counts.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.json_document import Node, read_json
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import LOSS, Tolerance

NAME: Final = "vehicle_shadowing.json"


@dataclass(frozen=True, slots=True)
class _Link:
    frequency: float
    inputs: Mapping[str, Array]
    golden: float
    place: str


@dataclass(frozen=True, slots=True)
class _Scene:
    category: str
    vehicles: Mapping[str, Array]
    links: tuple[_Link, ...]


@dataclass(frozen=True, slots=True)
class VehicleCheck(Check):
    """The scenes of the file."""

    scenes: tuple[_Scene, ...]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return LOSS

    @property
    @override
    def work(self) -> int:
        return len(self._frequencies())

    def _frequencies(self) -> list[float]:
        return sorted({link.frequency for one in self.scenes for link in one.links})

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        found: dict[str, list[tuple[str, float, float]]] = defaultdict(list)
        for frequency in self._frequencies():
            parameters = {"model": "veins", "carrier_frequency": frequency}
            with channel.start(parameters, {}) as session:
                for one in self.scenes:
                    links = [link for link in one.links if link.frequency == frequency]
                    if not links:
                        continue
                    session.step({**one.vehicles, **_together(links)})
                    ours = session.probed("vehicle_loss")
                    found[one.category] += [
                        (link.place, link.golden, float(loss))
                        for link, loss in zip(links, ours, strict=True)
                    ]
            progress.advance()
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
        )


def _together(links: list[_Link]) -> dict[str, Array]:
    return {name: np.concatenate([link.inputs[name] for link in links]) for name in links[0].inputs}


def read(path: Path) -> VehicleCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    return VehicleCheck(tuple(map(_scene, read_json(path, NAME).filled())))


def _scene(node: Node) -> _Scene:
    bodies = list(node["vehicles"])
    owners: dict[int, int] = {}
    for k, body in enumerate(bodies):
        antenna = body["antenna_id"].whole()
        if antenna in owners:
            raise body["antenna_id"].problem(
                f"{antenna} is the antenna of vehicle {owners[antenna]}"
            )
        owners[antenna] = k
    vehicles = scene.vehicles(
        range(len(bodies)),
        [(body["x"].number(), body["y"].number()) for body in bodies],
        [body["heading_rad"].number() for body in bodies],
        [[body[name].positive() for name in ("length", "width", "height")] for body in bodies],
        np.array([body["host_offset"].number() for body in bodies]),
    )
    links = tuple(_link(query, owners) for query in node["queries"])
    return _Scene(node["category"].text(), vehicles, links)


def _link(query: Node, owners: Mapping[int, int]) -> _Link:
    ends = [query[name].whole() for name in ("tx_antenna_id", "rx_antenna_id")]
    return _Link(
        frequency=query["freq_hz"].positive(),
        inputs=scene.links(
            query["tx"].numbers(3),
            query["rx"].numbers(3),
            [owners.get(antenna, NO_VEHICLE) for antenna in ends],
        ),
        golden=query["loss_db"].number(),
        place=f"{NAME}: {query.place} (id {query['id'].value if 'id' in query else '?'})",
    )
