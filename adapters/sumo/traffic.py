"""One run: all road users, from the first communication point to the last."""

import json
import math
from collections.abc import Mapping, Sequence

import numpy as np

from adapters.sumo.background import Background, Spawned, kept_clear
from adapters.sumo.cast import Cast
from adapters.sumo.census import Census
from adapters.sumo.connectors import OVER
from adapters.sumo.distributions import distributions_of
from adapters.sumo.driven import driven, signals_of_nobody
from adapters.sumo.ego import Command
from adapters.sumo.equipment import Outfitter
from adapters.sumo.errors import SumoError
from adapters.sumo.lights import Lights
from adapters.sumo.outcome import Instants
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.placement import Placement
from adapters.sumo.population import Vehicle
from adapters.sumo.road import read_road
from adapters.sumo.roadside import RoadsideUnits, check_places, units_of
from adapters.sumo.scene import VehicleTypes, read_buildings
from adapters.sumo.simulation import Sumo
from orchestrator.signal import Array, Signal, Signals
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Time, nanoseconds

_ROUNDING = 1e-9
"""A step of SUMO that is longer than its instants by less has no more of them."""


class Traffic:
    """All road users of one run and what they signal."""

    def __init__(
        self, sumo: Sumo, parameters: TrafficParameters, rng: np.random.Generator, start: Time
    ) -> None:
        """Populate the scene that `sumo` has loaded; takes one step of SUMO to insert everybody.

        Args:
            sumo: the simulation.
            parameters: of the component.
            rng: of the component.
            start: the first communication point [ns].

        Raises:
            SumoError: the scene and the parameters do not fit together.
        """
        self._sumo = sumo
        self._h = parameters.step_length
        self._step_length = nanoseconds(parameters.step_length)
        self._start = start
        self._instants = math.ceil(parameters.step_length / parameters.collision_step - _ROUNDING)
        self._steps = 0
        distributions = distributions_of(parameters.scene)
        types = VehicleTypes(sumo, parameters.antenna_above_roof, distributions)
        self._buildings = read_buildings(sumo, parameters.building_height)
        self._road = read_road(sumo.net)
        self._lights = Lights(sumo)
        units = units_of(parameters.entities)
        tallest = max((kind.size[2] for kind in types.declared()), default=0.0)
        check_places(units, buildings=self._buildings, road=self._road, tallest=tallest)
        self._roadside = RoadsideUnits(units)
        placed = Placement(sumo, types, rng).place(parameters.entities)
        self._cast = Cast(sumo, placed)
        self._driven = driven(parameters.entities)
        background, equipment = (np.random.default_rng(rng.integers(2**63)) for _ in range(2))
        self._background: Background | None = None
        if parameters.background is not None:
            clear = kept_clear(sumo, placed)
            self._background = Background(
                sumo, types.declared(), parameters.background, clear, background
            )
        self._outfitter = Outfitter(parameters.equipment, equipment)
        self._census = Census(sumo, types, self._outfitter)
        self._entered: list[tuple[int, str, str]] = []
        self._remarks: list[str] = []
        self._populate()
        self._entered += self._roadside.entered
        self.outputs = self._signals()

    def advance(self, commands: Mapping[str, Command], count: int) -> None:
        """Take `count` steps of SUMO while `commands` are asked for, by the names of the egos."""
        self._entered = []
        for ego in self._cast.egos.values():
            ego.begin_step()
        for _ in range(count):
            self._step(commands)
        self.outputs = self._signals()

    @property
    def absent(self) -> list[str]:
        """What to say of entities that have not entered, a sentence each."""
        return self._cast.absent

    def remarks(self) -> list[str]:
        """What may not be meant, a sentence each; each is told once."""
        told, self._remarks = self._remarks, []
        return told

    @property
    def _elapsed(self) -> float:
        """Time since the start, the nearest number to it [s]."""
        return self._steps * self._step_length / NANOSECONDS_PER_SECOND

    def _populate(self) -> None:
        """Insert everybody who is there at the start; the first step of SUMO moves nobody."""
        spawned = [] if self._background is None else self._background.place()
        self._move_on(spawned, frozenset())
        if self._cast.missing:
            raise SumoError("\n".join(self._cast.missing))
        census = self._census
        for ego in self._cast.egos.values():
            if ego.is_present:
                ego.look_around(self._start, census.roster, census.poses)

    def _step(self, commands: Mapping[str, Command]) -> None:
        """One step of SUMO."""
        census, egos = self._census, self._cast.egos
        before, poses = census.roster, census.poses
        now: Time = self._start + self._steps * self._step_length
        elapsed = self._elapsed
        present = [(name, ego) for name, ego in egos.items() if ego.is_present]
        leaving = frozenset(
            ego.name
            for name, ego in present
            if ego.drive(commands[name], now, self._step_length, self._instants)
        )
        self._cast.act(before, poses, elapsed, self._h)
        spawned = [] if self._background is None else self._background.enter(elapsed)
        self._steps += 1
        self._move_on(spawned, leaving)
        instants = Instants(begin=now, duration=self._step_length, count=self._instants)
        for _, ego in present:
            ego.look_back(
                instants, before, poses, census.roster, census.poses, has_left=ego.name in leaving
            )
        there = {name for name, _ in present}
        for name, ego in egos.items():
            if ego.is_present and name not in there:
                ego.look_around(now + self._step_length, census.roster, census.poses)

    def _move_on(self, spawned: Sequence[Spawned], leaving: frozenset[str]) -> None:
        """Take one step of SUMO, in which entities and `spawned` enter if there is room."""
        sumo, cast, census = self._sumo, self._cast, self._census
        expected = dict(cast.call(self._elapsed))
        for newcomer in spawned:
            sumo.add(newcomer.departure)
            expected[newcomer.name] = self._outfitter.equip(newcomer.name, newcomer.type)
        sumo.step()
        change = census.take(expected, leaving)
        cast.welcome(census.roster, census.poses, change.entered)
        cast.correct(census.roster, census.poses)
        self._remarks += cast.within_others(census.roster, census.poses, change.entered)
        self._note(change.entered)
        for newcomer in spawned:
            if census.roster.row(newcomer.name) is not None:
                cast.watch(newcomer.name, newcomer.path)
            else:
                sumo.withdraw(newcomer.name)
                self._outfitter.forget(expected[newcomer.name])

    def _note(self, entered: Sequence[Vehicle]) -> None:
        roster = self._census.roster
        self._entered += [(roster.number_of(v.key), v.name, v.type.name) for v in entered]

    def _signals(self) -> Signals:
        """The outputs; what did not change is the same object as before."""
        roster, poses = self._census.roster, self._census.poses
        egos = self._cast.egos
        position = np.zeros((len(roster.names), 3))
        position[:, :2] = poses.center
        arrays: dict[str, Array] = {
            "vehicle.id": roster.number,
            "vehicle.position": position,
            "vehicle.heading": poses.heading,
            "vehicle.velocity": poses.velocity,
            "vehicle.size": roster.size,
            "vehicle.antenna_height": roster.antenna_height,
            "vehicle.body": roster.body,
            "vehicle.equipped": roster.equipped,
            "vehicle.lidar": roster.lidar,
            "vehicle.role": roster.role,
            "building.vertex": self._buildings.vertex,
            "building.index": self._buildings.index,
            "building.height": self._buildings.height,
            "road.vertex": self._road.vertex,
            "road.index": self._road.index,
            **self._lights.signals(),
            OVER: np.array(bool(egos) and all(ego.outcome.is_over for ego in egos.values())),
        }
        for name in self._driven:
            ego = egos.get(name)
            signals = signals_of_nobody() if ego is None else ego.signals()
            arrays |= {f"{name}.{key}": array for key, array in signals.items()}
        arrays = self._roadside.join(arrays)
        for array in arrays.values():
            array.flags.writeable = False
        entered: Signal = json.dumps(self._entered).encode() if self._entered else b""
        return {**arrays, "entered": entered}
