"""Throughput and latency of every kind of message."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE, PACKET
from orchestrator import Measure
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.bins import spread_of
from studies.measures.radio import KINDS, received, table_of
from studies.measures.style import distribution, draw_distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivery(Measure):
    """Throughput and latency of messages, by their kind.

    A packet is delivered where it is received for the first time, on whatever hop: at its
    destination or, if it is a broadcast, at everybody. Throughput is what the packets handed to
    radios, or delivered, carry per second of the run, without the headers of MAC and LLC and added
    up over all radios. Latency is the time from there to the end of the frame with which a packet
    is delivered; queueing, contention and relays are in it, and the time of the application before
    is not. Packets that are not delivered have no latency.
    """

    by_default: ClassVar[bool] = True

    packets: str = parameter("facilities.packets", doc="`component.connector`")
    receptions: str = parameter("channel.receptions", doc="`component.connector`")

    @override
    def signals(self) -> Sequence[str]:
        return (self.packets, self.receptions)

    @override
    def compute(self, recording: Recording) -> Answer:
        sent = unique_packets(recording, self.packets)
        found: dict[int, list[Array]] = {kind: [] for kind in KINDS.values()}
        sizes = dict.fromkeys(KINDS.values(), 0)
        for time, packet in deliveries(recording, self.receptions, sent):
            latency = (time - sent["time"][packet]) * 1e-6  # [ms]
            kinds = sent["kind"][packet]
            for kind, parts in found.items():
                got = kinds == kind
                parts.append(latency[got])
                sizes[kind] += int(sent["size"][packet[got]].sum(dtype=np.int64))
        times = recording[self.packets].times
        duration = float(times[-1] - times[0]) * 1e-9 if len(times) > 1 else 0.0
        numbers: dict[str, float | int | bool | str | None] = {}
        curves = {}
        for name, kind in KINDS.items():
            own = sent["size"][sent["kind"] == kind]
            if len(own) == 0:
                continue
            latency = np.concatenate([np.empty(0), *found.pop(kind)])
            latency.sort()
            curves[name] = distribution(latency)
            numbers |= {
                f"{name}_packets": len(own),
                f"{name}_deliveries": len(latency),
                f"{name}_sent_kbit_s": _rate(int(own.sum(dtype=np.int64)), duration),
                f"{name}_delivered_kbit_s": _rate(sizes[kind], duration),
                **spread_of(latency, f"{name}_latency", "ms"),
            }
        return Answer(
            numbers=numbers, panel=lambda axes: draw_distribution(axes, curves, "latency [ms]")
        )


def unique_packets(recording: Recording, signal: str) -> Array:
    """All packets but noise, each once, by ascending id, `PACKET` records, shape (packet,)."""
    table = table_of(recording, signal, "PKTS", PACKET).records
    _, first = np.unique(table["id"], return_index=True)
    return np.asarray(table[first])


def deliveries(recording: Recording, receptions: str, sent: Array) -> Iterator[tuple[Array, Array]]:
    """First receptions of packets where they were to go, batch by batch.

    Args:
        recording: of a run.
        receptions: `component.connector`.
        sent: as `unique_packets` returns it.

    Yields:
        When each was received [ns], and the index into `sent` of its packet, shape (n,) both.

    Raises:
        ValueError: a packet was received that nobody sent.
    """
    heard = received(recording, receptions)
    delivered = np.empty(0, np.int64)  # where to, of packets that will be received again
    for batch in heard.batches("any"):
        rows = batch.records
        packet = sent_as(sent, rows["packet"], receptions)
        destination = sent["destination"][packet]
        own = np.flatnonzero((destination == NO_VEHICLE) | (destination == rows["receiver"]))
        order = own[np.argsort(rows["time"][own], kind="stable")]
        at = (packet[order] << 32) + rows["receiver"][order]
        _, first = np.unique(at, return_index=True)
        chosen, at = order[first], at[first]
        returns = np.isin(rows["packet"][chosen], heard.returning)
        is_new = ~(returns & np.isin(at, delivered))
        delivered = np.concatenate([delivered, at[returns & is_new]])
        yield rows["time"][chosen[is_new]], packet[chosen[is_new]]


def sent_as(sent: Array, packets: Array, receptions: str) -> Array:
    """Which of the packets that were sent those are that were received.

    Args:
        sent: as `unique_packets` returns it, or some of them, shape (packet,).
        packets: numbers of packets, shape (n,).
        receptions: where they are from, `component.connector`.

    Returns:
        Indices into `sent`, shape (n,).

    Raises:
        ValueError: a packet was received that nobody sent.
    """
    found = np.searchsorted(sent["id"], packets)
    is_known = found < len(sent)
    is_known[is_known] = sent["id"][found[is_known]] == packets[is_known]
    if not is_known.all():
        unknown = packets[~is_known][0]
        raise ValueError(f"`{receptions}` has packet {unknown}, which nobody sent")
    return found


def _rate(size: int, duration: float) -> float | None:
    """What messages of `size` [byte] make in `duration` [s], in kbit/s."""
    return float(size) * 8e-3 / duration if duration > 0 else None
