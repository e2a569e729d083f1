"""What an ego vehicle had when it had to decide whether to brake for somebody hidden."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE, RECEPTION, SENSOR_DATA
from orchestrator import Measure
from orchestrator.measure import Answer
from orchestrator.palette import COLOURS
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from orchestrator.suggestion import suggestion
from studies.measures.delivery import unique_packets
from studies.measures.knowledge import NEVER, from_others, from_sensors
from studies.measures.no_return import Body, conflict
from studies.measures.radio import plain, received
from studies.measures.sight import LOS, Bodies, Walls
from studies.measures.vehicles import ABSENT, Vehicles, beneath, vehicles_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_UNBRAKED: Final = 0.95
"""Share of its greatest speed so far from which on a vehicle has not begun to brake."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision(Measure):
    """What of the sharing node's last scans was there when the ego vehicle had to decide.

    The point of no return is the last moment at which a decision to brake with `deceleration`,
    `reaction` later, avoids that the ego vehicle and the hidden one meet, if the ego keeps the
    speed that it had before it began to brake, and the other one its velocity: so it is the same
    moment whether the ego brakes or not. Looked at is what had reached the ego by then of the scans
    of the `window` before, how old the newest was, when the ego first knew of the hidden vehicle,
    and what stood between the roofs of sharing node and ego vehicle meanwhile. The ego drives
    straight on; ways that cross at less than 10 degrees make no conflict.
    """

    ego: str = parameter("traffic.ego.id", doc="the signal of the ego's number")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    other: str = parameter("collider", doc="the entity that is hidden from the ego")
    source: str = parameter("sharer", doc="the entity that shares what it senses")
    building: str = parameter(
        "traffic.building", doc="what the signals of buildings begin with; read if recorded"
    )
    scans: str = parameter("perception.objects", doc="what is told at every scan, of objects")
    received: str = parameter("facilities.received.objects", doc="objects that the ego received")
    packets: str = parameter("facilities.packets", doc="`component.connector`")
    receptions: str = parameter("channel.receptions", doc="`component.connector`")
    deceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, doc="with which the ego would brake"
    )
    reaction: float = parameter(
        0.3, unit="s", minimum=0.0, doc="from the decision to it: two scans, and the brakes' lag"
    )
    window: float = parameter(
        1.0, unit="s", minimum=0.01, doc="before the point of no return that is looked at"
    )

    @override
    def signals(self) -> Sequence[str]:
        names = ("id", "position", "heading", "velocity", "size", "role")
        rest = (self.ego, self.scans, self.received, self.packets, self.receptions)
        return (*beneath(self.vehicle, *names), *rest)

    @override
    def compute(self, recording: Recording) -> Answer:
        scene = _Scene.of(self, recording)
        moment = scene.moment(self.deceleration, self.reaction)
        if moment is None:
            return Answer(numbers=dict.fromkeys(NUMBERS))
        window = round(self.window * 1e9)
        scans = _Scans.of(self, recording, scene, moment.no_return, window)
        numbers = {
            "no_return_s": moment.no_return * 1e-9,
            "meeting_s": moment.meeting * 1e-9,
            "braked_before_s": scene.braked_before(moment.no_return),
            **scans.numbers(),
            **_knowledge(self, recording, scene, moment.no_return),
            **scene.between(moment.no_return - window, moment.no_return),
        }
        return Answer(numbers=numbers, tables={"scans": scans.table()}, panel=scans.draw)


NUMBERS: Final = (
    "no_return_s", "meeting_s", "braked_before_s", "scans", "scans_there", "there", "age_s",
    "sent", "direct", "known_before_s", "told_before_s", "seen_before_s", "bodies_least",
    "bodies_mean", "obstructed", "in_sight",
)  # fmt: skip
"""What is found, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Moment:
    """When the ego had to decide [ns], and when the bodies would meet otherwise [ns]."""

    no_return: int
    meeting: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scene:
    """The rows of the three at every communication point, `ABSENT` where one is not there.

    Attributes:
        bodies: of all vehicles.
        velocity: of all vehicles [m/s], shape (row, 2).
        walls: of all buildings.
        ego, other, source: their rows, shape (point,) each.
    """

    bodies: Bodies
    velocity: Array
    walls: Walls
    ego: Array
    other: Array
    source: Array

    @classmethod
    def of(cls, asked: Decision, recording: Recording) -> "_Scene":
        vehicles = vehicles_in(recording, asked.vehicle)
        role = vehicles.values(recording, f"{asked.vehicle}.role")
        entities = _entities(recording, asked.vehicle)
        series = recording[asked.ego]
        newest = np.searchsorted(series.times, vehicles.times, side="right") - 1
        ids = np.asarray(series.values).reshape(len(series))[np.maximum(newest, 0)]
        ids = np.where(newest < 0, NEVER, ids)
        return cls(
            bodies=Bodies.of(recording, vehicles, asked.vehicle),
            velocity=vehicles.values(recording, f"{asked.vehicle}.velocity"),
            walls=Walls.of(recording, asked.building),
            ego=vehicles.rows(np.arange(len(vehicles.times)), ids),
            other=_first(vehicles, role == _role(entities, asked.other)),
            source=_first(vehicles, role == _role(entities, asked.source)),
        )

    @property
    def vehicles(self) -> Vehicles:
        return self.bodies.vehicles

    @property
    def _unbraked(self) -> Array:
        """Where the ego is there and has not begun to brake, bool, shape (point,)."""
        speed = np.hypot(*self.velocity[self.ego].T)
        speed[self.ego == ABSENT] = 0.0
        fast = speed >= _UNBRAKED * np.maximum.accumulate(speed)
        return np.asarray((self.ego != ABSENT) & (speed > 0.0) & fast)

    def moment(self, deceleration: float, reaction: float) -> _Moment | None:
        """The point of no return as it was last told before it, or before the ego braked."""
        found = None
        for point in np.flatnonzero(self._unbraked & (self.other != ABSENT)).tolist():
            now = int(self.vehicles.times[point])
            if found is not None and now > found.no_return:
                break
            first, other = self._body(int(self.ego[point])), self._body(int(self.other[point]))
            ahead = conflict(first, other)
            if ahead is not None:
                left = ahead.last_moment(first.speed, deceleration, reaction)
                meeting = ahead.meeting(first.speed)
                found = _Moment(
                    no_return=now + round(left * 1e9), meeting=now + round(meeting * 1e9)
                )
        return found

    def braked_before(self, time: int) -> float | None:
        """How long before `time` [ns] the ego began to brake for good [s]; `None`: it did not."""
        unbraked = self._unbraked
        last = int(np.flatnonzero(unbraked)[-1])
        if last + 1 == len(unbraked) or self.ego[last + 1] == ABSENT:
            return None
        return (time - int(self.vehicles.times[last + 1])) * 1e-9

    def between(self, begin: int, end: int) -> dict[str, float | int | None]:
        """What stood between the roofs from `begin` to `end` [ns]."""
        times = self.vehicles.times
        points = np.flatnonzero((times > begin) & (times <= end))
        points = points[(self.ego[points] != ABSENT) & (self.source[points] != ABSENT)]
        links, bodies, sights = [], [], []
        for point in points.tolist():
            present = slice(int(self.vehicles.first[point]), int(self.vehicles.first[point + 1]))
            a, b = self.source[[point]], self.ego[[point]]
            links.append(self.bodies.links(self.walls, present, a, b)[0])
            bodies.append(self.bodies.between(present, a, b)[0])
            if self.other[point] != ABSENT:
                sights.append(self.bodies.links(self.walls, present, b, self.other[[point]])[0])
        return {
            "bodies_least": int(min(bodies)) if bodies else None,
            "bodies_mean": float(np.mean(bodies)) if bodies else None,
            "obstructed": _mean([link != LOS for link in links]),
            "in_sight": _mean([link == LOS for link in sights]),
        }

    def _body(self, row: int) -> Body:
        return Body(
            center=self.vehicles.position[row, :2],
            heading=float(self.bodies.heading[row]),
            velocity=self.velocity[row],
            size=self.bodies.size[row, :2],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scans:
    """The scans before the point of no return, and when each had reached the ego.

    Attributes:
        moment: the point of no return [ns].
        window: how long before it is looked at [ns].
        times: of all scans until then [ns], ascending, shape (scan,).
        arrived: when the whole message with it had reached the ego [ns], or `NEVER`, shape (scan,).
        overheard: of the messages of the scans within the window, whether the ego could decode the
            first transmission itself, of all packets; bool, shape (message,).
    """

    moment: int
    window: int
    times: Array
    arrived: Array
    overheard: Array

    @classmethod
    def of(
        cls, asked: Decision, recording: Recording, scene: _Scene, moment: int, window: int
    ) -> "_Scans":
        point = scene.vehicles.at(np.array([moment]))[0]
        ego, source = (_number(scene, rows, point) for rows in (scene.ego, scene.source))
        times = recording[asked.scans].times
        times = times[times <= moment]
        sent = unique_packets(recording, asked.packets)
        for_ego = np.isin(sent["destination"], (ego, NO_VEHICLE)) & (sent["source"] == source)
        sent = sent[for_ego & (sent["kind"] == SENSOR_DATA) & (sent["time"] <= moment)]
        heard = _received_by(recording, asked.receptions, ego)
        when = _first_time(sent["id"], heard[heard["addressed"] == 1])
        direct = np.isin(sent["id"], heard["packet"][heard["hop"] == 0])
        at, message = np.unique(sent["time"], return_inverse=True)
        whole = np.zeros(len(at), np.int64)
        np.maximum.at(whole, message, np.where(when == NEVER, _LATE, when))
        heard_all = np.ones(len(at), bool)
        np.logical_and.at(heard_all, message, direct)
        scan = np.searchsorted(times, at, side="right") - 1
        arrived = np.full(len(times), _LATE)
        np.minimum.at(arrived, scan[scan >= 0], whole[scan >= 0])
        within = (scan >= 0) & (times[np.maximum(scan, 0)] > moment - window)
        return cls(
            moment=moment,
            window=window,
            times=times,
            arrived=np.where(arrived == _LATE, NEVER, arrived),
            overheard=heard_all[within],
        )

    @property
    def _there(self) -> Array:
        return np.asarray((self.arrived != NEVER) & (self.arrived <= self.moment))

    @property
    def _within(self) -> Array:
        return np.asarray(self.times > self.moment - self.window)

    def numbers(self) -> dict[str, float | int | None]:
        scans, there = int(self._within.sum()), int((self._within & self._there).sum())
        newest = self.times[self._there]
        return {
            "scans": scans,
            "scans_there": there,
            "there": there / scans if scans else None,
            "age_s": (self.moment - int(newest[-1])) * 1e-9 if len(newest) else None,
            "sent": len(self.overheard),
            "direct": _mean(self.overheard.tolist()),
        }

    def table(self) -> dict[str, Array]:
        """A row for each scan of the window: when, how long before, and when it was there."""
        own = self._within
        arrived = self.arrived[own]
        return {
            "scan_s": self.times[own] * 1e-9,
            "before_s": (self.moment - self.times[own]) * 1e-9,
            "arrived_s": np.where(arrived == NEVER, np.nan, arrived * 1e-9),
            "is_there": self._there[own],
        }

    def draw(self, axes: "Axes") -> None:
        """Draw which scans of the window were there."""
        table = self.table()
        looks = ((True, COLOURS[0], "o", "there"), (False, COLOURS[1], "x", "not"))
        for is_there, colour, mark, label in looks:
            own = table["is_there"] == is_there
            axes.plot(-table["before_s"][own], own[own] * is_there, mark, color=colour, label=label)
        axes.axvline(0.0, color="black", lw=0.8)
        axes.set_xlabel("scan, relative to the point of no return [s]")
        axes.set_yticks([0, 1], ["not there", "there"])
        axes.set_ylim(-0.5, 1.5)


_LATE: Final = np.iinfo(np.int64).max


def _knowledge(
    asked: Decision, recording: Recording, scene: _Scene, moment: int
) -> dict[str, float | None]:
    """How long before the point of no return the ego first knew of the other [s]."""
    point = scene.vehicles.at(np.array([moment]))[0]
    ego, other = (np.array([_number(scene, rows, point)]) for rows in (scene.ego, scene.other))
    begin = np.array([-1])
    sources = {
        "told_before_s": from_others(recording, asked.received, asked.ego, scene.bodies),
        "seen_before_s": from_sensors(recording, asked.scans, scene.bodies),
    }
    first = {name: int(each.next(ego, other, begin)[0]) for name, each in sources.items()}
    known = [time for time in first.values() if time != NEVER]
    found = {"known_before_s": min(known, default=NEVER), **first}
    return {n: None if t == NEVER else (moment - t) * 1e-9 for n, t in found.items()}


def _received_by(recording: Recording, receptions: str, receiver: int) -> Array:
    """The receptions of sensor data by one vehicle, shape (reception,)."""
    found = (
        batch.records[batch.records["receiver"] == receiver]
        for batch in received(recording, receptions).batches("sensor_data")
    )
    parts = (np.empty(0, RECEPTION), *found)
    return np.concatenate([plain(each) for each in parts]).view(RECEPTION)


def _first_time(packets: Array, heard: Array) -> Array:
    """When each packet was first received [ns], or `NEVER`, shape (packet,)."""
    order = np.lexsort((heard["time"], heard["packet"]))
    known, first = np.unique(heard["packet"][order], return_index=True)
    times = heard["time"][order][first]
    if len(known) == 0:
        return np.full(len(packets), NEVER, np.int64)
    place = np.minimum(np.searchsorted(known, packets), len(known) - 1)
    return np.where(known[place] == packets, times[place], NEVER)


def _entities(recording: Recording, vehicle: str) -> list[str]:
    """The names of the entities, in the order of their declarations."""
    components = recording.manifest["scenario"]["components"]
    traffic = components.get(vehicle.partition(".")[0], {})
    return list(traffic.get("parameters", {}).get("entities") or {})


def _role(entities: Sequence[str], name: str) -> int:
    """The number of an entity among roles.

    Raises:
        ValueError: there is no such entity.
    """
    if name not in entities:
        raise ValueError(f"there is no entity `{name}`; {suggestion(name, entities)}")
    return entities.index(name) + 1


def _first(vehicles: Vehicles, own: Array) -> Array:
    """The first row of each communication point that is one's own, or `ABSENT`, shape (point,)."""
    rows = np.flatnonzero(own)
    found = np.full(len(vehicles.times), ABSENT)
    points, first = np.unique(vehicles.points[rows], return_index=True)
    found[points] = rows[first]
    return found


def _number(scene: _Scene, rows: Array, point: int) -> int:
    """The number of whom `rows` are, at a communication point; `NEVER` if it is not there."""
    row = int(rows[point])
    return NEVER if row == ABSENT else int(scene.vehicles.ids[row])


def _mean(values: Sequence[bool]) -> float | None:
    return float(np.mean(values)) if values else None
