"""One run: all vehicles, from the first communication point to the last."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from adapters.sumo.cast import COLLIDER, EGO, Cast, assemble
from adapters.sumo.collision_driver import CollisionDriver
from adapters.sumo.ego import Command
from adapters.sumo.ego_driver import EgoDriver
from adapters.sumo.fleet import Poses, Roster, Vehicle
from adapters.sumo.outcome import FinishLine, Instants, Outcome
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.proximity import NOBODY, Closest, closest_approach
from adapters.sumo.road import read_road
from adapters.sumo.roadside import RoadsideUnits, check_places
from adapters.sumo.scene import frozen, read_buildings, read_types
from adapters.sumo.simulation import Sumo, SumoError
from adapters.sumo.spawning import Background, Spawned, background_streams
from adapters.traffic.geometry import Float
from orchestrator.signal import Array, Signals
from orchestrator.timebase import Time, nanoseconds

GONE: Final = -1
"""`ego.id` once the ego vehicle has left the net."""


class Traffic:
    """All vehicles of one run and what they signal."""

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
        self._instants = math.ceil(parameters.step_length / parameters.collision_step - 1e-9)
        self._steps = 0
        self._types = read_types(sumo)
        self._buildings = read_buildings(sumo)
        self._road = read_road(sumo)
        self._roadside = self._roadside_units(parameters)
        spread = parameters.collider_spread * rng.uniform(-1.0, 1.0)
        cast = assemble(sumo, self._types, parameters, parameters.collider_speed + spread)
        self._ego = EgoDriver(
            cast.ego, parameters.ego_speed, parameters.dynamics, parameters.actuation
        )
        self._finish = self._finish_line(cast, parameters)
        self._ego_size = frozen(np.array(cast.ego.vehicle.type.size))
        self._collider = CollisionDriver(sumo, cast, parameters.speed_control)
        self._background = self._background_of(cast, parameters, rng)
        self._roster = Roster.empty().changed(self._populate(cast), frozenset())
        self._ego_number = int(self._roster.number[self._roster.names.index(EGO)])
        self._poses = self._read_poses(self._roster)
        closest = self._closest(self._ego.pose[None], self._roster, self._poses)
        at_start = Instants(begin=start, duration=0, count=1)
        self._outcome = Outcome().after(at_start, closest.contact, None)
        self.outputs = self._signals(closest)

    def advance(self, command: Command, count: int) -> None:
        """Take `count` steps of SUMO while `command` is asked for."""
        closest = NOBODY
        for _ in range(count):
            closest = closest.or_closer(self._step(command))
        self.outputs = self._signals(closest)

    def _finish_line(self, cast: Cast, parameters: TrafficParameters) -> FinishLine:
        """`finish_distance` beyond the conflict point, or beyond the junction."""
        path = cast.ego.path
        beyond = self._sumo.lane_shape(cast.ego.next_lane)[0]
        station = path.station(*(cast.conflict if cast.encounter else beyond).tolist())
        length = cast.ego.vehicle.type.length
        return FinishLine(path, station + parameters.finish_distance, length)

    def _roadside_units(self, parameters: TrafficParameters) -> RoadsideUnits:
        positions, height = parameters.rsu_positions, parameters.rsu_antenna_height
        tallest = max(kind.size[2] for kind in self._types.values())
        check_places(positions, height, buildings=self._buildings, road=self._road, tallest=tallest)
        return RoadsideUnits(positions, height)

    def _background_of(
        self, cast: Cast, parameters: TrafficParameters, rng: np.random.Generator
    ) -> Background:
        streams = background_streams(
            self._sumo,
            reserved=cast.reserved,
            closed=cast.closed,
            limits=cast.limits,
            turning_share=parameters.turning_share,
        )
        return Background(streams, self._types, parameters.demand, rng)

    def _populate(self, cast: Cast) -> list[Vehicle]:
        """Insert everybody; the first step of SUMO moves nobody."""
        for role in cast.everybody:
            self._sumo.add(role.departure)
        entered = self._insert([role.vehicle for role in cast.everybody], self._background.place())
        missing = [r.vehicle.name for r in cast.everybody if r.vehicle not in entered]
        if missing:
            raise SumoError(
                f"there is no room for {', '.join(missing)} at the start; change `ego_start`, "
                "`blocking_count` or the lanes they start on"
            )
        if cast.encounter:
            self._sumo.ignore_everything(COLLIDER)
        return entered

    def _step(self, command: Command) -> Closest:
        """One step of SUMO; the smallest distance to the ego vehicle during it."""
        before, poses = self._roster, self._poses
        now: Time = self._start + self._steps * self._step_length
        ego_present = before.row(EGO) is not None
        track, left = self._ego.pose[None], frozenset[str]()
        if ego_present:
            track = self._ego.drive(command, now, self._step_length, self._instants)
            left = self._show_ego()
        self._collider.drive(before, poses, self._ego, self._h)
        newcomers = self._background.enter(self._steps * self._h, self._sumo.occupancy)
        entered = self._insert([], newcomers)
        self._steps += 1
        self._roster = before.changed(entered, left | self._sumo.arrived())
        self._poses = self._read_poses(self._roster)
        if not ego_present:
            return NOBODY
        closest = self._closest(track, before, poses)
        self._note(now, track, closest, has_left=bool(left))
        return closest

    def _note(self, now: Time, track: Float, closest: Closest, *, has_left: bool) -> None:
        """What the step from `now` [ns] means for the outcome; who leaves is through, too."""
        instants = Instants(begin=now, duration=self._step_length, count=len(track))
        passed = None if self._outcome.is_over else self._finish.passed(track)
        if passed is None and has_left:
            passed = len(track) - 1
        self._outcome = self._outcome.after(instants, closest.contact, passed)

    def _show_ego(self) -> frozenset[str]:
        """Let SUMO's drivers see where the ego vehicle is; its name, once it has left."""
        if self._ego.at_end:
            self._sumo.withdraw(EGO)
            return frozenset((EGO,))
        self._sumo.move(EGO, self._ego.front, self._ego.state.heading)
        return frozenset()

    def _insert(self, basic: Sequence[Vehicle], spawned: Sequence[Spawned]) -> list[Vehicle]:
        """Take one step of SUMO, in which `basic` and `spawned` enter if there is room."""
        for newcomer in spawned:
            self._sumo.add(newcomer.departure)
        self._sumo.step()
        departed = self._sumo.departed()
        for newcomer in spawned:
            if newcomer.vehicle.name in departed:
                self._collider.watch(newcomer)
            else:
                self._sumo.withdraw(newcomer.vehicle.name)
                self._background.forget(newcomer.vehicle)
        newcomers = [*basic, *(newcomer.vehicle for newcomer in spawned)]
        return [vehicle for vehicle in newcomers if vehicle.name in departed]

    def _read_poses(self, roster: Roster) -> Poses:
        """The poses of a roster from SUMO, and the ego's own state where it is."""
        poses = Poses.from_sumo(self._sumo.poses(roster.names), roster.size[:, 0])
        row = roster.row(EGO)
        if row is not None:
            poses.center[row] = self._ego.center
            poses.heading[row] = self._ego.state.heading
            poses.velocity[row] = self._ego.velocity
        return poses

    def _closest(self, track: Float, before: Roster, poses: Poses) -> Closest:
        """The smallest distance between the ego's body along `track` and any other body.

        Others are those who are there both `before` and now.
        """
        now = self._roster
        old = new = np.flatnonzero(now.number != self._ego_number)
        if now is not before:
            others = now.number[new]
            _, old, new = np.intersect1d(
                before.number, others, assume_unique=True, return_indices=True
            )
            new = np.searchsorted(now.number, others[new])
        return closest_approach(
            track,
            self._ego_size[:2],
            number=now.number[new],
            size=now.size[new, :2],
            a=poses.rows(old),
            b=self._poses.rows(new),
        )

    def _signals(self, closest: Closest) -> Signals:
        """The outputs; what did not change is the same object as before."""
        roster, poses, ego, outcome = self._roster, self._poses, self._ego, self._outcome
        present = roster.row(EGO) is not None
        position = np.zeros((len(roster.names), 3))
        position[:, :2] = poses.center
        signals: dict[str, Array] = {
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
            "ego.id": np.array(self._ego_number if present else GONE),
            "ego.position": ego.center,
            "ego.heading": np.array(ego.state.heading),
            "ego.speed": np.array(ego.state.speed),
            "ego.size": self._ego_size,
            "ego.route": ego.route if present else np.zeros((0, 2)),
            "ego.collision": np.array(outcome.has_collided),
            "ego.collision_time": np.array(outcome.collision_time),
            "ego.collision_partner": np.array(outcome.partner),
            "ego.completion_time": np.array(outcome.completion_time),
            "ego.gap": np.array(closest.gap),
            "ego.nearest": np.array(closest.vehicle),
            "encounter.over": np.array(outcome.is_over),
        }
        signals = self._roadside.join(signals)
        for signal in signals.values():
            signal.flags.writeable = False
        return signals
