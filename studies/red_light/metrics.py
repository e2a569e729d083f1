"""What happened in a run of the red-light study, as numbers."""

from typing import Any, Final

import numpy as np

from fmus.messages.records import LINKS, NO_VEHICLE, OBJECT, OUTCOMES, unframe
from studies.red_light.delivery import packet_reception, session
from studies.red_light.identity import vehicles_of
from studies.red_light.roles import Roles
from studies.red_light.traces import COLLISION, EGO, ROLE_WORDS, SHARING, Array, Traces

_RECEIVED: Final = OUTCOMES.index("R")
_PEDAL: Final = 0.1
"""More than this share of the full brake is no correction of the speed."""
_OUTCOME: Final = ("collision", "collision_time", "collision_partner", "completion_time")
"""Outputs of the traffic, beneath `ego`, that say how the encounter ended."""
_NEVER: Final = -1.0
"""Their time of what has not happened [s]."""


def compute(traces: Traces) -> dict[str, Any]:
    """All metrics of the run, ready for JSON; times in seconds.

    `success` is that the ego has completed and not collided; neither may have happened when the
    run ended. `collision_partner` is the role of the other vehicle.

    `prr.end_to_end` is the share of the packets of sensor data (or CPMs) for the ego that reached
    it over the chosen route; `prr.direct` the share of the same packets' first transmissions
    that the ego could decode itself, addressed to it or not. For the ego are those sent to it, and
    the broadcasts of the sharing node, where both are equal. Both are null if none was sent.
    """
    roles = Roles(
        ego=_known(traces.vehicle_with(EGO)),
        hidden=_known(traces.vehicle_with(COLLISION)),
        sharing=_known(traces.vehicle_with(SHARING)),
    )
    sent, heard = traces.packets, traces.receptions
    gaps = traces.gap_to_hidden
    return {
        **_encounter(traces),
        "min_gap_m": float(gaps[:, 1].min()) if len(gaps) else None,
        "min_gap_time": float(gaps[np.argmin(gaps[:, 1]), 0]) if len(gaps) else None,
        "min_speed": float(traces.scalars("traffic.ego.speed")[1].min()),
        "prr": packet_reception(sent, heard, roles, traces.end),
        "session": session(traces, roles),
        "links": links(heard, roles),
        "relay_switches": int(traces.scalars("relay.switches")[1][-1]),
        "relays": _distinct(traces.scalars("relay.relay")[1]),
        "packets_sent": len(sent),
        "bytes_sent": int(sent["size"].sum()),
        "hidden_vehicle": _hidden(traces, roles),
        "braking": _braking(traces),
    }


def links(heard: Array, roles: Roles) -> list[dict[str, Any]]:
    """PRR and link classes of the links that carried sensor data, busiest first.

    `mean_power_dbm` is null where the channel does not know the power (replayed recordings).
    """
    used = heard[(heard["addressed"] == 1) | (heard["receiver"] == roles.ego)]
    found = []
    for transmitter, receiver in sorted(
        {(int(r["transmitter"]), int(r["receiver"])) for r in used}
    ):
        link = used[(used["transmitter"] == transmitter) & (used["receiver"] == receiver)]
        counts = np.bincount(link["link"], minlength=len(LINKS))
        found.append(
            {
                "transmitter": transmitter,
                "receiver": receiver,
                "packets": len(link),
                "prr": float((link["outcome"] == _RECEIVED).mean()),
                "mean_power_dbm": _mean(link["power_dbm"]),
                "classes": dict(zip(LINKS, map(int, counts), strict=True)),
            }
        )
    return sorted(found, key=lambda entry: -entry["packets"])


def _encounter(traces: Traces) -> dict[str, Any]:
    """How the encounter ended for the ego, as known at the end of the run."""
    last = {name: traces.series(f"traffic.ego.{name}")[-1].item() for name in _OUTCOME}
    collided, completed = last["collision"], last["completion_time"] != _NEVER
    partner = traces.role_of(last["collision_partner"]) if collided else None
    return {
        "collision": collided,
        "collision_time": last["collision_time"] if collided else None,
        "collision_partner": None if partner is None else ROLE_WORDS[partner],
        "completion_time": last["completion_time"] if completed else None,
        "success": completed and not collided,
    }


def _hidden(traces: Traces, roles: Roles) -> dict[str, Any]:
    """When the hidden vehicle was first seen, by whom, and when the ego first knew.

    An object is the hidden vehicle if it lies where that vehicle is.
    """
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
    return {
        "id": roles.hidden,
        "first_seen": first[by] if by is not None else None,
        "first_seen_by": _who(by, roles),
        "seen_by_ego": first.get(roles.ego),
        "received_by_ego": received,
    }


def _braking(traces: Traces) -> dict[str, Any]:
    """The first brake for a hazard: when, for what, seen by whom, how old the data were.

    A network does not say what it brakes for: then only `pedal`, the time of the first real use
    of the brake, is known.
    """
    pedal = _first_brake(traces)
    times, tracks = traces.scalars("policy.hazard.instance")
    braked = np.flatnonzero(tracks >= 0)
    if len(braked) == 0:
        return {"pedal": pedal, "time": None, "object": None, "seen_by": None, "data_age": None}
    k = int(braked[0])
    sensor = int(traces.scalars("policy.hazard.sensor")[1][k])
    return {
        "pedal": pedal,
        "time": float(times[k]),
        "object": _tracked(traces, round(float(times[k]) * 1e9), sensor, int(tracks[k])),
        "seen_by": sensor,
        "data_age": float(traces.scalars("policy.hazard.age")[1][k]),
    }


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


def _distinct(values: Array) -> list[int]:
    """The relays that were chosen, in order of first choice."""
    return list(dict.fromkeys(int(v) for v in values if v != NO_VEHICLE))
