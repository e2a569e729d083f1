"""What is on the air: packets, how often each was sent and received, and who heard it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.messages.records import (
    BSM,
    FATES,
    NO_VEHICLE,
    OUTCOMES,
    PACKET,
    RECEPTION,
    TRANSMISSION,
)
from orchestrator.page.layer import Curve, PageOfRun
from orchestrator.signal import Array
from studies.measures.radio import batches, plain, table_of
from studies.top_view.crowd import Crowd
from studies.top_view.listeners import Listeners, listeners_of
from studies.top_view.signals import Sources

MOST_PACKETS: Final = 40_000
MOST_RECEPTIONS: Final = 80_000

_MICROSECOND: Final = 1000
_WINDOWS: Final = 300
_SHORTEST: Final = 200_000_000
"""Windows of shares are so long at least [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Heard:
    """All receptions, counted, and those that somebody on the page heard.

    Attributes:
        fates: how many receptions of each packet had each outcome, shape (packet, outcome).
        records: `RECEPTION`, shape (n,).
        packet: the packet of each, shape (n,).
        shares: how many of each window had each outcome, shape (window, outcome).
    """

    fates: Array
    records: Array
    packet: Array
    shares: Array


def radio_of(
    run: PageOfRun, sources: Sources, crowd: Crowd
) -> tuple[Mapping[str, Any] | None, list[Curve]]:
    """What the scripts read, and curves.

    Args:
        run: whose page it is.
        sources: its signals.
        crowd: everybody.
    """
    if not (sources.packets and sources.receptions):
        return None, []
    table = table_of(run.recording, sources.packets, "PKTS", PACKET).records
    _, first = np.unique(table["id"], return_index=True)
    packets = table[first]
    if not len(packets):
        return None, []
    routes = crowd.index(packets["route"].reshape(-1))
    relays, counts = np.unique(routes[routes >= 0], return_counts=True)
    used = relays[np.argsort(-counts, kind="stable")]
    listeners = listeners_of(run, crowd, sources.egos, used)
    length = max(_SHORTEST, -(-(run.stop - run.start) // _WINDOWS))
    heard = _heard(run, sources.receptions, crowd, packets, listeners=listeners, length=length)
    stride = _stride(packets, heard)
    kept = _kept(packets, stride)
    data = {
        **_packets(run, crowd, packets[kept], heard.fates[kept]),
        **_receptions(run, crowd, heard, kept),
        **_transmissions(run, sources.transmissions, crowd, packets, kept=kept),
        "full": listeners.full.tolist(),
        "partly": listeners.partly.tolist(),
        "stride": stride,
        "outcomes": OUTCOMES,
        "fate_words": list(FATES),
    }
    curves = [*_shares(run, heard.shares, length), *_powers(crowd, heard, listeners)]
    return data, curves


def _heard(
    run: PageOfRun,
    receptions: str,
    crowd: Crowd,
    packets: Array,
    *,
    listeners: Listeners,
    length: int,
) -> _Heard:
    kinds = len(OUTCOMES)
    windows = -(-(run.stop - run.start) // length) + 1
    fates = np.zeros(len(packets) * kinds, np.int64)
    shares = np.zeros(windows * kinds, np.int64)
    parts, owners = [plain(np.empty(0, RECEPTION))], [np.empty(0, np.int64)]
    for batch in batches(run.recording, receptions, "RCPT", RECEPTION):
        records = batch.records
        packet = np.searchsorted(packets["id"], records["packet"])
        packet = packet.clip(0, len(packets) - 1)
        is_known = packets["id"][packet] == records["packet"]
        records, packet = records[is_known], packet[is_known]
        counts = records["addressed"] == 1
        outcome = records["outcome"].astype(np.int64)
        fates += np.bincount((packet * kinds + outcome)[counts], minlength=len(fates))
        window = ((records["time"] - run.start) // length).clip(0, windows - 1)
        shares += np.bincount((window * kinds + outcome)[counts], minlength=len(shares))
        is_rare = records["kind"] != BSM
        is_sent_to = counts & (packets["destination"][packet] != NO_VEHICLE)
        receiver, sender = (crowd.index(records[end]) for end in ("receiver", "transmitter"))
        wanted = np.flatnonzero(listeners.wants(receiver, sender, is_rare) | is_sent_to)
        parts.append(plain(records[wanted]))
        owners.append(packet[wanted])
    return _Heard(
        fates=fates.reshape(-1, kinds),
        records=np.concatenate(parts).view(RECEPTION),
        packet=np.concatenate(owners),
        shares=shares.reshape(-1, kinds),
    )


def _stride(packets: Array, heard: _Heard) -> int:
    """Every how manyth BSM of each vehicle is on the page."""
    many = np.count_nonzero(packets["kind"] == BSM) / MOST_PACKETS
    much = np.count_nonzero(heard.records["kind"] == BSM) / MOST_RECEPTIONS
    return max(1, int(np.ceil(max(many, much))))


def _kept(packets: Array, stride: int) -> Array:
    """Whether each packet is on the page: all but BSMs, and every `stride`th BSM of each."""
    is_bsm = packets["kind"] == BSM
    order = np.lexsort((packets["id"], packets["source"], ~is_bsm))
    source = packets["source"][order]
    begins = np.ones(len(order), bool)
    begins[1:] = source[1:] != source[:-1]
    since = np.arange(len(order)) - np.maximum.accumulate(
        np.where(begins, np.arange(len(order)), 0)
    )
    number = np.empty(len(order), np.int64)
    number[order] = since
    return np.asarray(~is_bsm | (number % stride == 0))


def _packets(run: PageOfRun, crowd: Crowd, packets: Array, fates: Array) -> Mapping[str, Any]:
    add, most = run.arrays.add, (1 << 16) - 1
    return {
        "packets": {
            "id": add(packets["id"] - packets["id"][0], "i4", deltas=1),
            "first": int(packets["id"][0]),
            "time": run.times(packets["time"], _MICROSECOND),
            "source": add(crowd.index(packets["source"]), "i4"),
            "destination": add(crowd.index(packets["destination"]), "i4"),
            "route": add(crowd.index(packets["route"]).T, "i4"),
            "size": add(packets["size"], "i4"),
            "kind": add(packets["kind"], "u1"),
            "fates": add(fates.T.clip(0, most), "u2"),
        }
    }


def _receptions(run: PageOfRun, crowd: Crowd, heard: _Heard, kept: Array) -> Mapping[str, Any]:
    """Receptions by receiver, then by packet."""
    place = np.cumsum(kept) - 1
    rows = np.flatnonzero(kept[heard.packet])
    receiver = crowd.index(heard.records["receiver"][rows])
    packet, hop = place[heard.packet[rows]], heard.records["hop"][rows]
    order = np.lexsort((hop, packet, receiver))
    rows, receiver, packet = rows[order], receiver[order], packet[order]
    records = heard.records[rows]
    owners, ends = np.unique(receiver[::-1], return_index=True)
    code = records["outcome"] | (records["link"] << 3) | (records["addressed"] << 5)
    add, rounded = run.arrays.add, run.arrays.rounded
    return {
        "heard": {
            "receivers": owners.tolist(),
            "ends": (len(receiver) - ends).tolist(),
            "packet": add(packet, "i4", deltas=1),
            "hop": add(records["hop"], "u1"),
            "transmitter": add(crowd.index(records["transmitter"]), "i4"),
            "power": rounded(records["power_dbm"], 0.1),
            "snir": rounded(records["snir_db"], 0.1),
            "code": add(code, "u1"),
        }
    }


def _transmissions(
    run: PageOfRun, transmissions: str, crowd: Crowd, packets: Array, *, kept: Array
) -> Mapping[str, Any]:
    if not transmissions:
        return {}
    place = np.cumsum(kept) - 1
    sent = table_of(run.recording, transmissions, "SENT", TRANSMISSION).records
    packet = np.searchsorted(packets["id"], sent["packet"]).clip(0, len(packets) - 1)
    rows = np.flatnonzero((packets["id"][packet] == sent["packet"]) & kept[packet])
    order = np.lexsort((sent["hop"][rows], packet[rows]))
    rows = rows[order]
    sent, packet = sent[rows], packet[rows]
    add = run.arrays.add
    return {
        "sent": {
            "packet": add(place[packet], "i4", deltas=1),
            "wait": add((sent["time"] - sent["queued"]) // _MICROSECOND, "i4"),
            "late": add((sent["time"] - packets["time"][packet]) // _MICROSECOND, "i4"),
            "duration": add(sent["duration"] // _MICROSECOND, "i4"),
            "hop": add(sent["hop"], "u1"),
            "fate": add(sent["fate"], "u1"),
            "transmitter": add(crowd.index(sent["transmitter"]), "i4"),
        }
    }


def _shares(run: PageOfRun, counts: Array, length: int) -> list[Curve]:
    """What became of frames that were noticed, over time."""
    letters = {letter: counts[:, k] for k, letter in enumerate(OUTCOMES)}
    every = np.sum([letters[letter] for letter in "RNCBT"], axis=0)
    times = run.start + np.arange(len(counts)) * length
    groups = {
        "frames received": "R",
        "lost to noise": "N",
        "lost to interference": "C",
        "lost, receiver busy or sending": "BT",
    }
    found = []
    for name, group in groups.items():
        with np.errstate(invalid="ignore"):
            share = np.sum([letters[letter] for letter in group], axis=0) / every
        curve = Curve(name=name, unit="share", times=times, values=share, holds=True, shown=True)
        found.append(curve)
    return found


def _powers(crowd: Crowd, heard: _Heard, listeners: Listeners) -> list[Curve]:
    """What full listeners receive of declared entities [dBm]."""
    found = []
    records = heard.records
    transmitter, receiver = (crowd.index(records[end]) for end in ("transmitter", "receiver"))
    declared = np.flatnonzero((crowd.roles > 0) & crowd.radio).tolist()[:4]
    for listener in listeners.full.tolist():
        for sender in declared:
            rows = np.flatnonzero((receiver == listener) & (transmitter == sender))
            times, first = np.unique(records["time"][rows], return_index=True)
            if len(times) > 1:
                ends = [crowd.names[k] or f"vehicle {crowd.ids[k]}" for k in (sender, listener)]
                name = f"power of {ends[0]} at {ends[1]}"
                power = records["power_dbm"][rows][first]
                found.append(Curve(name=name, unit="dBm", times=times, values=power, shown=True))
    return found[:12]
