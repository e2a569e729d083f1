"""Share of hidden road users known, and time to first knowledge."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import LINKS
from orchestrator import Measure
from orchestrator.errors import ParameterProblem
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.bins import (
    bin_columns,
    bin_of,
    edges_parameter,
    edges_problems,
    share,
    shares,
)
from studies.measures.first_knowledge import Meetings, meetings
from studies.measures.knowledge import (
    NEVER,
    Knowledge,
    Windows,
    from_messages,
    from_others,
    from_sensors,
)
from studies.measures.links import Links, lengthened, link as pair_of
from studies.measures.radio import Kind
from studies.measures.sight import LOS, Bodies, Walls
from studies.measures.style import draw_shares, draw_survival
from studies.measures.vehicles import beneath, near_pairs, plane_distance, vehicles_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_EDGES: Final = tuple(20.0 * k for k in range(6))
_HIDDEN: Final = "hidden"
_GROUPS: Final = (_HIDDEN, *LINKS)
_BLOCK: Final = 500_000
"""Rows that are looked at together."""
_COLUMNS: Final[Mapping[str, type[np.signedinteger[Any]]]] = {
    "instant": np.int32,
    "observer": np.int32,
    "road_user": np.int32,
    "place": np.int16,
    "link": np.int8,
}
"""Columns of `_Looks`; vehicles are below 2^31."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenRoadUsers(Measure):
    """Share of the road users out of sight that an observer knows, and how soon it does.

    Of all road users within the distances of `edges` of an observer that a building or a body hides
    from it, the share that it knows: of which it had an object of its own sensor, a message of
    theirs (`kind`), or an object that others sent, within `memory`. It is the environmental
    awareness ratio of research on collective perception (see docs/measures.md), of those who cannot
    be seen; `ear` is that of all, in sight or not.

    Hidden is who is not in sight from roof to roof: a wall crosses the line and is higher than it,
    or a third body is. Time to first knowledge begins when an observer has a road user within the
    last of `edges` and hidden for the first time, and ends with the first knowledge of it. It is
    censored when the road user comes in sight, leaves or the run ends before; the median is that of
    Kaplan and Meier (JASA 53, 1958).
    """

    by_default: ClassVar[bool] = True

    observers: str = parameter(
        "traffic.vehicle.equipped",
        doc="the signal that says who observes, of every vehicle, or of one its number "
        "(`traffic.ego.id`)",
    )
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    building: str = parameter(
        "traffic.building", doc="what the signals of buildings begin with; read if recorded"
    )
    packets: str = parameter("facilities.packets", doc="`component.connector`; read if recorded")
    receptions: str = parameter("channel.receptions", doc="`component.connector`; read if recorded")
    objects: str = parameter(
        "perception.objects", doc="objects of sensors, `component.connector`; read if recorded"
    )
    received: str = parameter(
        "facilities.received.objects", doc="objects that `ego` received; read if recorded"
    )
    ego: str = parameter("traffic.ego.id", doc="the number of whom `received` is")
    kind: Kind = parameter("bsm", doc="of the messages that tell of their source")
    memory: float = parameter(1.0, unit="s", minimum=0.001, doc="how long knowledge lasts")
    interval: float = parameter(0.2, unit="s", minimum=0.001, doc="in which is looked once")
    edges: tuple[float, ...] = edges_parameter(_EDGES)

    @override
    def signals(self) -> Sequence[str]:
        names = ("id", "position", "heading", "size")
        return (*beneath(self.vehicle, *names), self.observers)

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        return edges_problems(self.edges)

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        bodies = Bodies.of(recording, vehicles, self.vehicle)
        looks = _Looks.of(self, recording, bodies)
        memory = round(self.memory * 1e9)
        sources, missing = self._sources(recording, bodies, looks.windows(memory))
        known = {name: looks.known(source, memory) for name, source in sources.items()}
        is_known = np.any([np.zeros(len(looks.instant), bool), *known.values()], axis=0)
        found = meetings(looks.sequence(), is_known, list(sources.values()))
        table = self._table(looks, is_known, known)
        return Answer(
            numbers={
                **_shares(looks, is_known, known),
                **found.numbers(),
                "sources": ", ".join(sources) or None,
                "not_recorded": ", ".join(missing) or None,
            },
            tables={"distance": table, "first": found.table()},
            panel=lambda axes: _draw(axes, table),
            panels={"time to first knowledge": lambda axes: draw_survival(axes, found.curve())},
        )

    def _sources(
        self, recording: Recording, bodies: Bodies, windows: Windows
    ) -> tuple[dict[str, Knowledge], list[str]]:
        """The sources of knowledge that were recorded, and the signals that were not."""
        needs = {
            "sensing": (self.objects,),
            "messages": (self.packets, self.receptions),
            "others": (self.received, self.ego),
        }
        missing = {k: [name for name in v if name not in recording] for k, v in needs.items()}
        found = {}
        if not missing["sensing"]:
            found["sensing"] = from_sensors(recording, self.objects, bodies)
        if not missing["messages"]:
            found["messages"] = from_messages(
                recording, self.packets, self.receptions, self.kind, windows
            )
        if not missing["others"]:
            found["others"] = from_others(recording, self.received, self.ego, bodies)
        return found, [name for names in missing.values() for name in names]

    def _table(
        self, looks: "_Looks", is_known: Array, known: Mapping[str, Array]
    ) -> dict[str, Array]:
        """A row for every group, those who are hidden first, and bin of distance."""
        place, bins = looks.place, len(self.edges) - 1
        rows: dict[str, list[Array]] = {}
        for group in _GROUPS:
            own = looks.group(group) & (place >= 0)
            counts = {"road_users": own, "known": own & is_known}
            counts |= {f"by_{name}": own & each for name, each in known.items()}
            for name, each in counts.items():
                rows.setdefault(name, []).append(np.bincount(place[each], minlength=bins))
        columns = {name: np.concatenate(parts) for name, parts in rows.items()}
        known_share, low, high = shares(columns["known"], columns["road_users"])
        bounds = {n: np.tile(c, len(_GROUPS)) for n, c in bin_columns(self.edges).items()}
        return {
            "link": np.repeat(_GROUPS, bins),
            **bounds,
            **columns,
            "share": known_share,
            "low": low,
            "high": high,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Looks:
    """Whom observers had around them at each instant, a row for each.

    There are millions of rows, so that their columns are of small types.

    Attributes:
        times: the instants, which are communication points of traffic [ns], shape (instant,).
        instant: the index of each row, ascending, int32, shape (row,).
        observer: who looks, int32, shape (row,).
        road_user: who is looked for, int32, shape (row,).
        place: bin of the distance in the plane, int16, shape (row,).
        link: `LOS`, `NLOSV` or `NLOSB`, int8, shape (row,).
    """

    times: Array
    instant: Array
    observer: Array
    road_user: Array
    place: Array
    link: Array

    @classmethod
    def of(cls, asked: HiddenRoadUsers, recording: Recording, bodies: Bodies) -> "_Looks":
        vehicles, walls = bodies.vehicles, Walls.of(recording, asked.building)
        has_body = bodies.size[:, 0] > 0  # roadside units have none
        observes = has_body & _observes(asked, recording, bodies)
        points = _spaced(vehicles.times, round(asked.interval * 1e9))
        columns: dict[str, list[Array]] = {n: [np.empty(0, t)] for n, t in _COLUMNS.items()}
        for k, point in enumerate(points.tolist()):
            present = slice(int(vehicles.first[point]), int(vehicles.first[point + 1]))
            rows = np.flatnonzero(has_body[present]) + present.start
            a, b = near_pairs(vehicles, rows, asked.edges[-1])
            counts = observes[a] | observes[b]
            a, b = a[counts], b[counts]
            link, distance = bodies.links(walls, present, a, b), plane_distance(vehicles, a, b)
            place = bin_of(distance, asked.edges)
            for who, whom in ((a, b), (b, a)):  # the line is the same
                own = observes[who]
                row = {
                    "instant": np.full(own.sum(), k),
                    "observer": vehicles.ids[who[own]],
                    "road_user": vehicles.ids[whom[own]],
                    "place": place[own],
                    "link": link[own],
                }
                for name, kind in _COLUMNS.items():
                    columns[name].append(row[name].astype(kind))
        whole = {name: np.concatenate(columns.pop(name)) for name in _COLUMNS}
        return cls(times=vehicles.times[points], **whole)

    def known(self, source: Knowledge, memory: int) -> Array:
        """Whether a source told of each road user within `memory` [ns] before, bool, (row,)."""
        found = np.zeros(len(self.instant), bool)
        for rows in self._blocks():
            times = self.times[self.instant[rows]]
            latest = source.latest(self.observer[rows], self.road_user[rows], times)
            found[rows] = (latest != NEVER) & (latest > times - memory)
        return found

    def windows(self, memory: int) -> Windows:
        """What is asked of each pair: until the instant after it was last there together.

        Args:
            memory: how long before the first instant it matters, too [ns].
        """
        links, first, last = Links(), np.empty(0, np.int64), np.empty(0, np.int64)
        for rows in self._blocks():
            pair = links.meet(pair_of(self.observer[rows], self.road_user[rows]))
            first = lengthened(first, len(links), len(self.times))
            last = lengthened(last, len(links), 0)
            np.minimum.at(first, pair, self.instant[rows])
            np.maximum.at(last, pair, self.instant[rows])
        return Windows(
            links=links,
            since=self.times[first] - memory,
            until=self.times[np.minimum(last + 1, len(self.times) - 1)],
        )

    def _blocks(self) -> Iterator[slice]:
        """All rows, in blocks of which some columns more fit into memory."""
        for start in range(0, len(self.instant), _BLOCK):
            yield slice(start, start + _BLOCK)

    def group(self, name: str) -> Array:
        """The rows of a class of links, or of all who are hidden, bool, shape (row,)."""
        return np.asarray(self.link != LOS if name == _HIDDEN else self.link == LINKS.index(name))

    def sequence(self) -> Meetings:
        """The rows for the question how long something took."""
        return Meetings(
            times=self.times,
            instant=self.instant,
            observer=self.observer,
            road_user=self.road_user,
            link=self.link,
        )


def _observes(asked: HiddenRoadUsers, recording: Recording, bodies: Bodies) -> Array:
    vehicles = bodies.vehicles
    if asked.observers.startswith(f"{asked.vehicle}."):
        return vehicles.values(recording, asked.observers).astype(bool)
    series = recording[asked.observers]
    newest = np.searchsorted(series.times, vehicles.times, side="right") - 1
    numbers = np.asarray(series.values).reshape(len(series), -1)[np.maximum(newest, 0)]
    numbers[newest < 0] = NEVER
    return np.asarray((vehicles.ids[:, None] == numbers[vehicles.points]).any(axis=1))


def _spaced(times: Array, interval: int) -> Array:
    """The first communication point, and the first in every further interval, as indices."""
    _, first = np.unique((times - times[0]) // interval, return_index=True)
    return np.asarray(first)


def _shares(
    looks: _Looks, is_known: Array, known: Mapping[str, Array]
) -> dict[str, float | int | None]:
    """How many were hidden, and what share of them was known, over all distances."""
    hidden = looks.group(_HIDDEN)
    count = int(hidden.sum())
    numbers = share(int((hidden & is_known).sum()), count, "known")
    by_source = {f"known_by_{n}": _share(int((hidden & e).sum()), count) for n, e in known.items()}
    by_link: dict[str, float | int | None] = {}
    for name in LINKS[1:]:
        own = looks.group(name)
        by_link |= {
            f"known_{name}": _share(int((own & is_known).sum()), int(own.sum())),
            f"hidden_{name}": int(own.sum()),
        }
    everybody = {"ear": _share(int(is_known.sum()), len(is_known)), "road_users": len(is_known)}
    return {**numbers, "hidden": count, **by_source, **by_link, **everybody}


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _draw(axes: "Axes", table: Mapping[str, Array]) -> None:
    place = (table["from_m"] + table["to_m"]) / 2
    rows = {}
    for name in _GROUPS:
        own = table["link"] == name
        label = "all hidden" if name == _HIDDEN else name
        rows[label] = (place[own], table["share"][own], table["low"][own], table["high"][own])
    draw_shares(axes, rows)
    axes.set_ylabel("share of road users known")
