"""What happened in a run of the red-light study, as numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.messages.records import LINKS, NO_VEHICLE, OBJECT, OUTCOMES, unframe
from studies.red_light.delivery import Reception, Session, packet_reception, session
from studies.red_light.identity import Roles, vehicles_of
from studies.red_light.roles import COLLISION, EGO, ROLE_WORDS, SHARING
from studies.red_light.traces import Array, Traces

_RECEIVED: Final = OUTCOMES.index("R")
_PEDAL: Final = 0.1
"""More than this share of the full brake is no correction of the speed."""
_NEVER: Final = -1.0
"""What the traffic gives as the time of what has not happened [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A link that carried sensor data.

    Attributes:
        transmitter: the id of the sender.
        receiver: the id of the receiver.
        packets: the number of transmissions.
        prr: the share of them that was received, 0 to 1.
        mean_power_dbm: their mean received power [dBm]; `None` where the channel does not know it
            (replayed recordings).
        classes: the number of transmissions of every class of `LINKS`.
    """

    transmitter: int
    receiver: int
    packets: int
    prr: float
    mean_power_dbm: float | None
    classes: Mapping[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenVehicle:
    """When the hidden vehicle was first seen, by whom, and when the ego first knew.

    Attributes:
        id: the id of the vehicle.
        first_seen: when a sensor first saw it [s].
        first_seen_by: whose sensor that was: `ego`, `sharing node` or `vehicle ID`.
        seen_by_ego: when the ego's own sensor first saw it [s].
        received_by_ego: when the ego first had it in a message [s].
    """

    id: int
    first_seen: float | None
    first_seen_by: str | None
    seen_by_ego: float | None
    received_by_ego: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Braking:
    """The first brake for a hazard: when, for what, seen by whom, how old the data were.

    A network does not say what it brakes for: then only `pedal` is known.

    Attributes:
        pedal: when the brake was first really used [s].
        time: when the policy first named a hazard [s].
        object: the id of the vehicle that is the hazard.
        seen_by: the id of the vehicle whose sensor saw it; `NO_VEHICLE` if the policy knows the
            truth.
        data_age: the age of the data [s].
    """

    pedal: float | None
    time: float | None = None
    object: int | None = None
    seen_by: int | None = None
    data_age: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """What happened in a run; the fields are the keys of `metrics.json`.

    Attributes:
        collision: whether the ego collided.
        collision_time: when it did [s].
        collision_partner: the role of the other vehicle.
        completion_time: when the ego had completed its way [s].
        success: whether the ego has completed and not collided; neither may have happened when the
            run ended.
        min_gap_m: the smallest distance between the bodies of ego and hidden vehicle at a
            communication point of the traffic [m]; `None` if they were never there together.
        min_gap_time: when that was [s].
        min_speed: the lowest speed of the ego [m/s].
        prr: how many of the packets of sensor data for the ego reached it.
        session: what fusion had since it was first triggered.
        links: the links that carried sensor data, busiest first.
        relay_switches: number of changes of the relay while fusion was triggered.
        relays: the ids of the relays that were chosen, in order of first choice.
        packets_sent: the number of packets handed to the radios.
        bytes_sent: their size together [B].
        hidden_vehicle: when the hidden vehicle was seen.
        braking: the first brake for a hazard.
        ego_gap_m: the smallest value of the signal `traffic.ego.gap`, the distance to any vehicle,
            also between two communication points [m]; `None` without one.
        ego_gap_time: the communication point that ends the step in which that was [s].
        ego_gap_vehicle: the id of the vehicle.
    """

    collision: bool
    collision_time: float | None
    collision_partner: str | None
    completion_time: float | None
    success: bool
    min_gap_m: float | None
    min_gap_time: float | None
    min_speed: float
    prr: Reception
    session: Session
    links: tuple[Link, ...]
    relay_switches: int
    relays: tuple[int, ...]
    packets_sent: int
    bytes_sent: int
    hidden_vehicle: HiddenVehicle
    braking: Braking
    ego_gap_m: float | None = None
    ego_gap_time: float | None = None
    ego_gap_vehicle: int | None = None


def compute(traces: Traces) -> Metrics:
    """All metrics of a run."""
    roles = Roles(
        ego=_known(traces.vehicle_with(EGO)),
        hidden=_known(traces.vehicle_with(COLLISION)),
        sharing=_known(traces.vehicle_with(SHARING)),
    )
    sent, heard = traces.packets, traces.receptions
    gaps = traces.gap_to_hidden
    collided, completion = _at_end(traces, "collision"), _at_end(traces, "completion_time")
    is_completed = completion != _NEVER
    return Metrics(
        collision=collided,
        collision_time=_at_end(traces, "collision_time") if collided else None,
        collision_partner=_partner(traces) if collided else None,
        completion_time=completion if is_completed else None,
        success=is_completed and not collided,
        min_gap_m=float(gaps[:, 1].min()) if len(gaps) else None,
        min_gap_time=float(gaps[np.argmin(gaps[:, 1]), 0]) if len(gaps) else None,
        min_speed=float(traces.scalars("traffic.ego.speed")[1].min()),
        prr=packet_reception(sent, heard, roles, traces.end),
        session=session(traces, roles),
        links=_links(heard, roles),
        relay_switches=int(traces.scalars("relay.switches")[1][-1]),
        relays=_distinct(traces.scalars("relay.relay")[1]),
        packets_sent=len(sent),
        bytes_sent=int(sent["size"].sum()),
        hidden_vehicle=_hidden(traces, roles),
        braking=_braking(traces),
        **_gap_to_any(traces),
    )


def _gap_to_any(traces: Traces) -> dict[str, Any]:
    """The smallest gap that the traffic told of, where it told of any."""
    names = ("traffic.ego.gap", "traffic.ego.nearest")
    if not all(map(traces.has, names)):
        return {}
    (times, gaps), (_, vehicles) = (traces.scalars(name) for name in names)
    k = int(np.argmin(gaps))
    if int(vehicles[k]) == NO_VEHICLE:
        return {}
    return {
        "ego_gap_m": float(gaps[k]),
        "ego_gap_time": float(times[k]),
        "ego_gap_vehicle": int(vehicles[k]),
    }


def _links(heard: Array, roles: Roles) -> tuple[Link, ...]:
    """The links that carried sensor data, busiest first."""
    used = heard[(heard["addressed"] == 1) | (heard["receiver"] == roles.ego)]
    ends = sorted({(int(r["transmitter"]), int(r["receiver"])) for r in used})
    found = [_link(used, transmitter, receiver) for transmitter, receiver in ends]
    return tuple(sorted(found, key=lambda link: -link.packets))


def _link(heard: Array, transmitter: int, receiver: int) -> Link:
    own = heard[(heard["transmitter"] == transmitter) & (heard["receiver"] == receiver)]
    counts = np.bincount(own["link"], minlength=len(LINKS))
    return Link(
        transmitter=transmitter,
        receiver=receiver,
        packets=len(own),
        prr=float((own["outcome"] == _RECEIVED).mean()),
        mean_power_dbm=_mean(own["power_dbm"]),
        classes=dict(zip(LINKS, map(int, counts), strict=True)),
    )


def _at_end(traces: Traces, name: str) -> Any:
    """What the traffic says beneath `ego` at the end of the run."""
    return traces.series(f"traffic.ego.{name}")[-1].item()


def _partner(traces: Traces) -> str | None:
    """The role of whom the ego collided with."""
    role = traces.role_of(_at_end(traces, "collision_partner"))
    return None if role is None else ROLE_WORDS[role]


def _hidden(traces: Traces, roles: Roles) -> HiddenVehicle:
    """When the hidden vehicle was seen: an object is it if it lies where that vehicle is."""
    first: dict[int, float] = {}
    for time, table in traces.objects("perception.objects"):
        for sensor in np.unique(table["sensor"][vehicles_of(table, traces) == roles.hidden]):
            first.setdefault(int(sensor), time / 1e9)
    received = None
    for time, table in traces.objects("facilities.received.objects"):
        if (vehicles_of(table, traces) == roles.hidden).any():
            received = time / 1e9
            break
    by = min(first, key=lambda sensor: first[sensor]) if first else None
    return HiddenVehicle(
        id=roles.hidden,
        first_seen=first[by] if by is not None else None,
        first_seen_by=_who(by, roles),
        seen_by_ego=first.get(roles.ego),
        received_by_ego=received,
    )


def _braking(traces: Traces) -> Braking:
    pedal = _first_brake(traces)
    times, tracks = traces.scalars("policy.hazard.instance")
    braked = np.flatnonzero(tracks >= 0)
    if len(braked) == 0:
        return Braking(pedal=pedal)
    k = int(braked[0])
    sensor = int(traces.scalars("policy.hazard.sensor")[1][k])
    return Braking(
        pedal=pedal,
        time=float(times[k]),
        object=_tracked(traces, round(float(times[k]) * 1e9), sensor, int(tracks[k])),
        seen_by=sensor,
        data_age=float(traces.scalars("policy.hazard.age")[1][k]),
    )


def _first_brake(traces: Traces) -> float | None:
    """When the brake was first used by more than `_PEDAL` [s]."""
    commands = traces.series("policy.command")
    for k, time in enumerate(commands.times.tolist()):
        if commands[k][1] > _PEDAL:
            return float(time / 1e9)
    return None


def _tracked(traces: Traces, time: int, sensor: int, track: int) -> int | None:
    """The vehicle that a sensor's track is, as known to the ego at `time` [ns].

    Who knows the truth names no sensor, and the vehicle itself.
    """
    if sensor == NO_VEHICLE:
        return track
    for name in ("perception.objects", "facilities.received.objects"):
        known = unframe("OBJS", bytes(traces.at(name, time)), OBJECT)
        known = known[(known["sensor"] == sensor) & (known["instance"] == track)]
        vehicles = vehicles_of(known, traces)
        if (vehicles != NO_VEHICLE).any():
            return int(vehicles[vehicles != NO_VEHICLE][-1])
    return None


def _mean(values: Array) -> float | None:
    """The mean of those that are known; NaN stands for "not known"."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else None


def _who(vehicle: int | None, roles: Roles) -> str | None:
    names = {roles.ego: "ego", roles.sharing: "sharing node"}
    return None if vehicle is None else names.get(vehicle, f"vehicle {vehicle}")


def _known(vehicle: int | None) -> int:
    return NO_VEHICLE if vehicle is None else vehicle


def _distinct(values: Array) -> tuple[int, ...]:
    """The relays that were chosen, in order of first choice."""
    return tuple(dict.fromkeys(int(v) for v in values if v != NO_VEHICLE))
