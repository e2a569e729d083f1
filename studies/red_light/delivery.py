"""How much of the sensor data reached the ego."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import NO_VEHICLE, OUTCOMES, SENSOR_DATA
from studies.red_light.identity import Roles
from studies.red_light.traces import Array, Traces

_RECEIVED: Final = OUTCOMES.index("R")
_CAUSES: Final = {
    "N": "noise",
    "C": "interference",
    "B": "receiver_busy",
    "T": "receiver_transmitting",
    "U": "unnoticed",
}
"""What an outcome is called as a cause of loss, a field of `Losses`."""

IN_FLIGHT: Final = 50_000_000
"""A packet that was handed over so shortly before the end may still be on its way [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Losses:
    """Shares of the packets that did not reach the ego, by what happened on the last hop tried.

    Attributes:
        noise: the frame could not be decoded.
        interference: other frames made it undecodable.
        receiver_busy: the receiver was busy with another frame.
        receiver_transmitting: the receiver was sending itself.
        unnoticed: the frame was too weak to be noticed, or not sent (any more).
    """

    noise: float
    interference: float
    receiver_busy: float
    receiver_transmitting: float
    unnoticed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Reception:
    """How many of the packets of sensor data (or CPMs) for the ego reached it, as shares 0 to 1.

    For the ego are packets sent to it, and the broadcasts of the sharing node. All shares are
    `None` if none was sent.

    Attributes:
        end_to_end: the packets that reached the ego over the chosen route.
        direct: those whose first transmission the ego could decode itself, addressed to it or not;
            equal to `end_to_end` for broadcasts.
        messages: the messages that reached it whole, with every packet.
        sent: the number of packets.
        lost: the packets that did not reach it, by cause.
    """

    end_to_end: float | None
    direct: float | None
    messages: float | None
    sent: int
    lost: Losses | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Session:
    """What fusion had, scan by scan, from the moment at which it was first triggered.

    Attributes:
        begin: the time of the first trigger [s]; `None` if fusion was not triggered.
        scans: the number of scans since then.
        served: messages that reached the ego whole, per scan. Unlike the PRR it counts data that
            were never sent, because no request arrived, too; `None` without scans.
    """

    begin: float | None
    scans: int
    served: float | None


def packet_reception(sent: Array, heard: Array, roles: Roles, end: int) -> Reception:
    """How many of the packets of sensor data for the ego reached it.

    Packets handed to the radio less than `IN_FLIGHT` before the end are left out.

    Args:
        sent: `PACKET` records, shape (packet,).
        heard: `RECEPTION` records of sensor data, shape (reception,).
        roles: who is who.
        end: the end of the run [ns].
    """
    wanted = _for_ego(sent, roles, end)
    if len(wanted) == 0:
        return Reception(end_to_end=None, direct=None, messages=None, sent=0, lost=None)
    arrived, overheard = _arrived(wanted, heard, roles), _overheard(wanted, heard, roles)
    return Reception(
        end_to_end=float(arrived.mean()),
        direct=float(overheard.mean()),
        messages=float(_whole(wanted, arrived).mean()),
        sent=len(wanted),
        lost=_losses(wanted[~arrived], heard, roles, len(wanted)),
    )


def session(traces: Traces, roles: Roles) -> Session:
    """What fusion had since it was first triggered."""
    times, triggered = traces.scalars("perception.match.trigger")
    if not triggered.any():
        return Session(begin=None, scans=0, served=None)
    begin = float(times[np.argmax(triggered)])
    scans = int(np.count_nonzero((times >= begin) & (times * 1e9 <= traces.end - IN_FLIGHT)))
    wanted = _for_ego(traces.packets, roles, traces.end)
    whole = _whole(wanted, _arrived(wanted, traces.receptions, roles))
    served = np.count_nonzero(whole) / scans if scans else None
    return Session(begin=begin, scans=scans, served=served)


def _for_ego(sent: Array, roles: Roles, end: int) -> Array:
    if roles.ego == NO_VEHICLE:
        return sent[:0]
    broadcast = (sent["destination"] == NO_VEHICLE) & (sent["source"] == roles.sharing)
    for_ego = (sent["destination"] == roles.ego) | broadcast
    in_time = sent["time"] <= end - IN_FLIGHT
    return np.asarray(sent[(sent["kind"] == SENSOR_DATA) & for_ego & in_time])


def _losses(lost: Array, heard: Array, roles: Roles, sent: int) -> Losses:
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
    return Losses(**{cause: count / sent for cause, count in counts.items()})


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
