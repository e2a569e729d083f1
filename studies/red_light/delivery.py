"""How much of the sensor data reached the ego."""

from typing import Any, Final

import numpy as np

from fmus.messages.records import NO_VEHICLE, OUTCOMES, SENSOR_DATA
from studies.red_light.roles import Roles
from studies.red_light.traces import Array, Traces

_RECEIVED: Final = OUTCOMES.index("R")
_CAUSES: Final = {
    "N": "noise",
    "C": "interference",
    "B": "receiver_busy",
    "T": "receiver_transmitting",
    "U": "unnoticed",
}
"""What an outcome is called as a cause of loss."""

IN_FLIGHT: Final = 50_000_000
"""A packet that was handed over so shortly before the end may still be on its way [ns]."""


def packet_reception(sent: Array, heard: Array, roles: Roles, end: int) -> dict[str, Any]:
    """PRR of the sensor data (or CPMs) for the ego; null where none was sent.

    For the ego are packets sent to it, and the broadcasts of the sharing node. Packets handed to
    the radio less than `IN_FLIGHT` before the end [ns] are left out.

    Args:
        sent: `PACKET` records.
        heard: `RECEPTION` records of sensor data.
        roles: who is who.
        end: of the run [ns].

    Returns:
        `end_to_end`: share of the packets that reached the ego over the chosen route;
        `direct`: share of their first transmissions that the ego could decode itself, addressed
        to it or not, equal for broadcasts; `messages`: share of the messages that reached it whole,
        with every packet; `sent`: number of packets; `lost`: shares of the packets that did not
        reach it, by what happened on the last hop that was tried: `noise`, `interference`,
        `receiver_busy` with another frame, `receiver_transmitting`, or `unnoticed`: too weak to be
        noticed, or not sent (any more).
    """
    wanted = _for_ego(sent, roles, end)
    if len(wanted) == 0:
        return {"end_to_end": None, "direct": None, "messages": None, "sent": 0, "lost": None}
    arrived, overheard = _arrived(wanted, heard, roles), _overheard(wanted, heard, roles)
    return {
        "end_to_end": float(arrived.mean()),
        "direct": float(overheard.mean()),
        "messages": float(_whole(wanted, arrived).mean()),
        "sent": len(wanted),
        "lost": _losses(wanted[~arrived], heard, roles, len(wanted)),
    }


def session(traces: Traces, roles: Roles) -> dict[str, Any]:
    """What fusion had, scan by scan, from the moment at which it was first triggered.

    Unlike the PRR, `served` counts data that were never sent, because no request arrived, too.

    Returns:
        `begin`: the first trigger [s]; `scans`: number of scans since then; `served`: messages
        that reached the ego whole, per scan. Null where fusion was not triggered.
    """
    times, triggered = traces.scalars("perception.match.trigger")
    if not triggered.any():
        return {"begin": None, "scans": 0, "served": None}
    begin = float(times[np.argmax(triggered)])
    scans = int(np.count_nonzero((times >= begin) & (times * 1e9 <= traces.end - IN_FLIGHT)))
    wanted = _for_ego(traces.packets, roles, traces.end)
    whole = _whole(wanted, _arrived(wanted, traces.receptions, roles))
    served = np.count_nonzero(whole) / scans if scans else None
    return {"begin": begin, "scans": scans, "served": served}


def _for_ego(sent: Array, roles: Roles, end: int) -> Array:
    if roles.ego == NO_VEHICLE:
        return sent[:0]
    broadcast = (sent["destination"] == NO_VEHICLE) & (sent["source"] == roles.sharing)
    for_ego = (sent["destination"] == roles.ego) | broadcast
    in_time = sent["time"] <= end - IN_FLIGHT
    return np.asarray(sent[(sent["kind"] == SENSOR_DATA) & for_ego & in_time])


def _losses(lost: Array, heard: Array, roles: Roles, sent: int) -> dict[str, float]:
    """Shares of `sent` by the cause of loss.

    The last hop of a packet that was tried is the last of its receptions by an addressee; one that
    succeeded there was not heard of any more. Of a broadcast only the ego's reception counts.
    """
    routed = lost["id"][lost["destination"] != NO_VEHICLE]
    counts_for = (heard["receiver"] == roles.ego) | np.isin(heard["packet"], routed)
    tried = heard[(heard["addressed"] == 1) & counts_for & np.isin(heard["packet"], lost["id"])]
    tried = tried[np.lexsort((tried["hop"], tried["packet"]))]
    last = np.append(tried["packet"][1:] != tried["packet"][:-1], [True])[: len(tried)]
    outcomes = [OUTCOMES[outcome] for outcome in tried["outcome"][last]]
    counts = dict.fromkeys(_CAUSES.values(), 0)
    for outcome in outcomes:
        counts[_CAUSES.get(outcome, "unnoticed")] += 1
    counts["unnoticed"] += len(lost) - len(outcomes)
    return {cause: count / sent for cause, count in counts.items()}


def _arrived(wanted: Array, heard: Array, roles: Roles) -> Array:
    """Whether each packet reached the ego as an addressee; bool, (packet,)."""
    mine = heard[(heard["receiver"] == roles.ego) & (heard["outcome"] == _RECEIVED)]
    return np.isin(wanted["id"], mine["packet"][mine["addressed"] == 1])


def _overheard(wanted: Array, heard: Array, roles: Roles) -> Array:
    """Whether the ego decoded the first transmission of each packet; bool, (packet,)."""
    mine = heard[(heard["receiver"] == roles.ego) & (heard["outcome"] == _RECEIVED)]
    return np.isin(wanted["id"], mine["packet"][mine["hop"] == 0])


def _whole(wanted: Array, arrived: Array) -> Array:
    """Whether each message arrived with all its packets; bool, (message,).

    The packets of a message have its source, destination and time.
    """
    columns = [wanted[name] for name in ("source", "destination", "time")]
    _, message = np.unique(np.stack(columns), axis=1, return_inverse=True)
    lost = np.bincount(message.ravel(), weights=~arrived)
    return np.asarray(lost == 0)
