"""Drives the perception FMU: point clouds and APMs in, its outputs out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.apm import Apm, Float, decode, split
from fmus.messages.records import OBJECT, unframe
from orchestrator.signal import Array
from tests.fmus.driver import WARNING, Instance, Library

STEP: Final = 0.1
"""Communication step size of the tests [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """All outputs of the FMU."""

    apms_signal: bytes
    objects_signal: bytes
    centers: Float  # of the blind zones in use, (zone, 2)
    ranges: Float  # (zone,)
    sharers: Array  # in use, (sharer,)
    benefits: Float  # (sharer,)
    trigger: bool

    @property
    def messages(self) -> list[bytes]:
        """The APM messages."""
        return split(self.apms_signal)

    @property
    def apms(self) -> list[Apm]:
        """The APMs."""
        return [decode(message) for message in self.messages]

    @property
    def objects(self) -> Array:
        """The objects, OBJECT[object]."""
        return unframe("OBJS", self.objects_signal, OBJECT)


class Perception(Instance):
    """One instance. `settings` are parameters and structural parameters by name."""

    worst_status = WARNING  # it warns of messages that it drops

    def __init__(self, library: Library, **settings: float) -> None:
        super().__init__(library)
        self.time = 0.0
        lengths = {name: value for name, value in settings.items() if name.startswith("n_")}
        self.resize(**{"n_route_vertex": 0, "n_road_vertex": 0, **lengths})
        for name in settings.keys() - lengths:
            self.set(name, np.array(settings[name]))
        self.enter_initialization()

    def set_inputs(
        self,
        points: bytes,
        received: bytes = b"",
        ego: int = -1,
        route: Float | None = None,
        road: Sequence[Float] = (),
    ) -> None:
        """Set every input; `road` is the polygons of the drivable surface."""
        vertices = np.empty((0, 2)) if route is None else route
        if len(vertices) != self.get("n_route_vertex")[0]:
            self.resize(n_route_vertex=len(vertices))
        self.set_road(
            np.concatenate([np.empty((0, 2)), *road]),
            np.repeat(np.arange(len(road)), [len(ring) for ring in road]),
        )
        self.set("points", points)
        self.set("received", received)
        self.set("ego.id", np.array(ego))
        self.set("route.vertex", vertices)

    def set_road(self, vertex: Float, index: Array) -> None:
        """Set the road to corners [m] and the polygon of each."""
        if len(vertex) != self.get("n_road_vertex")[0]:
            self.resize(n_road_vertex=len(vertex))
        self.set("road.vertex", vertex)
        self.set("road.index", index)

    def begin(self) -> None:
        """Leave initialisation mode."""
        self.call("ExitInitializationMode")

    def advance(self) -> list[str]:
        """Step with the inputs as set; returns what was logged."""
        first = len(self.messages)
        self.do_step(self.time, STEP)
        self.time += STEP
        return self.messages[first:]

    def step(
        self,
        points: bytes,
        received: bytes = b"",
        ego: int = -1,
        route: Float | None = None,
        road: Sequence[Float] = (),
    ) -> Outputs:
        """One communication step, from initialisation on if it is the first."""
        if self.time == 0.0:
            self.begin()
        self.set_inputs(points, received, ego, route, road)
        self.advance()
        return self.outputs()

    def outputs(self) -> Outputs:
        """All outputs."""
        zones, sharers = int(self.get("n_blind_zone")[0]), int(self.get("n_sharer")[0])
        ranges = self.get("blind_zone.range", zones)
        ids = self.get("match.sharer", sharers)
        used = int((ids >= 0).sum())
        assert (ids[used:] == -1).all()
        count = int((ranges > 0).sum())
        assert (ranges[count:] == 0).all()
        return Outputs(
            apms_signal=self.get_binary("apms"),
            objects_signal=self.get_binary("objects"),
            centers=self.get("blind_zone.center", 2 * zones).reshape(-1, 2)[:count],
            ranges=ranges[:count],
            sharers=ids[:used],
            benefits=self.get("match.benefit", sharers)[:used],
            trigger=bool(self.get("match.trigger")[0]),
        )
