"""The entities of a scenario: who they are, when they enter, and who moves them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from adapters.sumo.driven import Ego, finish_line
from adapters.sumo.errors import SumoError
from adapters.sumo.overlaps import overlaps
from adapters.sumo.placement import Anywhere, OnRoad, Placed
from adapters.sumo.population import Kind, Poses, Roster, Vehicle
from adapters.sumo.scripted import SpeedProfile, Trajectory
from adapters.sumo.simulation import Departure, Sumo
from adapters.sumo.stage import Stage
from adapters.sumo.synchronised import Synchronised
from adapters.traffic.geometry import Float, direction
from adapters.traffic.polyline import Polyline

_HELD_BACK: Final = (
    "there was no room, or SUMO did not let it enter at its `speed` with what was ahead"
)


class Cast:
    """All entities but roadside units.

    Args:
        sumo: the simulation.
        placed: at their places.

    Raises:
        SumoError: somebody cannot do what is declared; all of them are named.

    Attributes:
        egos: the driven ones, by the names of their declarations.
    """

    def __init__(self, sumo: Sumo, placed: Sequence[Placed]) -> None:
        self._sumo = sumo
        self._waiting = list(placed)
        self._pending: list[Placed] = []
        self._placed = {each.vehicle.key: each for each in placed}
        self._first = {each.called: each for each in reversed(placed)}
        self.egos: dict[str, Ego] = {}
        self._synchronised: dict[str, Synchronised] = {}
        self._profiles: list[SpeedProfile] = []
        self._bodies: dict[str, Trajectory] = {}
        problems: list[str] = []
        for each in placed:
            try:
                self._assign(each)
            except SumoError as error:
                problems.append(str(error))
        if problems:
            raise SumoError("\n".join(dict.fromkeys(problems)))

    def _assign(self, placed: Placed) -> None:
        """Say who moves somebody; nobody here if SUMO does."""
        entity, key = placed.entity, placed.vehicle.key
        if isinstance(placed.place, Anywhere):
            self._bodies[key] = Trajectory(placed)
        elif entity.is_driven:
            self.egos[placed.called] = Ego(
                self._sumo, placed, finish_line(self._sumo, placed, self._first)
            )
        elif entity.synchronise is not None:
            other = self._first[entity.synchronise.entity]
            self._synchronised[key] = Synchronised(self._sumo, placed, other)
        elif entity.speed_profile:
            self._profiles.append(SpeedProfile(self._sumo, placed))

    def watch(self, name: str, path: Polyline) -> None:
        """Note a vehicle on its `path` that may have to give way to somebody."""
        for driver in self._synchronised.values():
            driver.giving_way.watch(name, path)

    def call(self, elapsed: float) -> Mapping[str, Vehicle]:
        """Have those enter with the next step whose time has come, `elapsed` [s] after the start.

        Returns:
            Those who may enter, by key; who finds no room tries again.
        """
        self._pending += [each for each in self._waiting if each.entity.enters <= elapsed]
        self._waiting = [each for each in self._waiting if each.entity.enters > elapsed]
        for each in self._pending:
            if self._sumo.is_pending(each.vehicle.name):
                continue
            try:
                self._add(each)
            except SumoError as error:
                raise SumoError(f"`entities.{each.called}`: {error}") from error
        return {each.vehicle.key: each.vehicle for each in self._pending}

    def welcome(self, roster: Roster, poses: Poses, entered: Sequence[Vehicle]) -> None:
        """Note who of the entities `entered`, and let them go as they are declared.

        Args:
            roster: has their numbers.
            poses: theirs; whoever starts faster than SUMO lets it enter gets its speed in them.
            entered: whoever did.
        """
        keys = {vehicle.key for vehicle in entered}
        here = [each for each in self._pending if each.vehicle.key in keys]
        self._pending = [each for each in self._pending if each.vehicle.key not in keys]
        for each in here:
            if isinstance(each.place, OnRoad):
                self._let_go(each, each.place.departure, roster, poses)
            if each.called in self.egos:
                self.egos[each.called].enter(roster.number_of(each.vehicle.key))
            if each.vehicle.key in self._synchronised or each.entity.speed_profile:
                self._sumo.ignore_everything(each.vehicle.name)

    @property
    def missing(self) -> list[str]:
        """What to say of those who found no room yet, a sentence each."""
        return [f"`entities.{each.called}`: {_refusal(each)}" for each in self._pending]

    @property
    def absent(self) -> list[str]:
        """What to say at the end of those who have not entered, a sentence each."""
        late = [(each, "that was later") for each in self._waiting]
        held = [(each, _HELD_BACK) for each in self._pending]
        return [
            f"`entities.{each.called}`: `{each.vehicle.name}` was to enter "
            f"{each.entity.enters:g} s after the start and has not by the end: {why}"
            for each, why in held + late
        ]

    def within_others(
        self, roster: Roster, poses: Poses, entered: Sequence[Vehicle]
    ) -> Iterator[str]:
        """What to say of those who `entered` at coordinates, and within others; a sentence each.

        Args:
            roster: who is there.
            poses: theirs, corrected.
            entered: whoever did.
        """
        keys = [vehicle.key for vehicle in entered if vehicle.key in self._bodies]
        for key, other in overlaps(keys, roster, poses) if keys else ():
            yield (
                f"`entities.{self._placed[key].called}`: `position`: the body of "
                f"`{roster.of(key).name}` is within that of `{roster.of(other).name}` as it "
                "enters; SUMO keeps no room at `x` and `y`"
            )

    def act(self, roster: Roster, poses: Poses, elapsed: float, h: float) -> None:
        """Move those who are moved from here in the next step; driven ones have moved.

        Args:
            roster: who is there.
            poses: theirs.
            elapsed: since the start [s].
            h: duration of the step [s].
        """
        if not (self._synchronised or self._profiles or self._bodies):
            return
        driven = {e.name: e.whereabouts for e in self.egos.values() if e.has_entered}
        stage = Stage(roster=roster, poses=poses, driven=driven, elapsed=elapsed, h=h)
        for synchronised in self._synchronised.values():
            synchronised.drive(stage)
        for profile in self._profiles:
            profile.drive(stage)
        for key, body in self._bodies.items():
            if roster.row(key) is not None:
                body.advance(stage)
                self._show(self._placed[key].vehicle, body)

    def correct(self, roster: Roster, poses: Poses) -> None:
        """Put what is known better here than in SUMO into `poses`: of those moved from here."""
        for row, center, heading, velocity in self._known(roster):
            poses.center[row] = center
            poses.heading[row] = heading
            poses.velocity[row] = velocity

    def _known(self, roster: Roster) -> Iterator[tuple[int, Float, float, Float]]:
        for ego in self.egos.values():
            row = roster.row(ego.name)
            if row is not None:
                yield row, ego.driver.center, ego.driver.state.heading, ego.driver.velocity
        for key, body in self._bodies.items():
            row = roster.row(key)
            if row is not None:
                yield row, body.center, body.heading, body.velocity

    def _add(self, placed: Placed) -> None:
        vehicle = placed.vehicle
        if isinstance(placed.place, OnRoad):
            departure = placed.place.departure
            self._sumo.add(departure)
            if placed.entity.parked:
                edge = self._sumo.net.edge_of(placed.place.lane)
                self._sumo.park(departure.name, edge, departure.lane, departure.position)
            return
        body = self._bodies[vehicle.key]
        if vehicle.kind is Kind.PERSON:
            self._sumo.add_person(vehicle.name, vehicle.type.name, body.front)
        else:
            self._sumo.add_near(vehicle.name, vehicle.type.name, body.front)
        self._show(vehicle, body)

    def _let_go(self, placed: Placed, departure: Departure, roster: Roster, poses: Poses) -> None:
        """Undo what SUMO wanted to let somebody enter: an end of its way, and a lower speed."""
        if not departure.looks_ahead:
            self._sumo.set_out(departure)
        if departure.speed is not None and departure.speed < placed.speed:
            self._sumo.set_present_speed(departure.name, placed.speed)
            row = roster.row(placed.vehicle.key)
            if row is not None:
                poses.velocity[row] = placed.speed * direction(poses.heading[row])

    def _show(self, vehicle: Vehicle, body: Trajectory) -> None:
        if vehicle.kind is Kind.PERSON:
            self._sumo.move_person(vehicle.name, body.front, body.heading)
        else:
            self._sumo.move(vehicle.name, body.front, body.heading, exactly=True)


def _refusal(placed: Placed) -> str:
    """Why somebody may not have entered at the start, and what to change."""
    name, speed = placed.vehicle.name, placed.speed
    if speed == 0.0:
        return (
            f"there is no room for `{name}` at the start; change its `position` or `count`, or "
            "what others keep clear"
        )
    if placed.entity.ignores_lights:
        why = f"a vehicle is too close to it at its `speed`, {speed:g} m/s"
    else:
        why = (
            f"SUMO lets nobody enter who could not stop for what is ahead (a light, a junction "
            f"where it gives way, a vehicle), and its `speed` is {speed:g} m/s"
        )
    return (
        f"there is no room for `{name}` at the start, or {why}; change its `position`, `speed` or "
        "`count`, or what others keep clear"
    )
