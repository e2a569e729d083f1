"""Throughput and latency of every kind of message."""

from collections.abc import Sequence
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
from studies.measures.bins import spread
from studies.measures.radio import KINDS, received, table_of
from studies.measures.style import draw_distribution


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
        heard, packet = deliveries(recording, self.receptions, sent)
        latency = (heard["time"] - sent["time"][packet]) * 1e-6  # [ms]
        times = recording[self.packets].times
        duration = float(times[-1] - times[0]) * 1e-9 if len(times) > 1 else 0.0
        numbers: dict[str, float | int | bool | str | None] = {}
        by_kind = {}
        for name, kind in KINDS.items():
            own, got = sent[sent["kind"] == kind], sent["kind"][packet] == kind
            if len(own) == 0:
                continue
            by_kind[name] = latency[got]
            numbers |= {
                f"{name}_packets": len(own),
                f"{name}_deliveries": int(got.sum()),
                f"{name}_sent_kbit_s": _rate(own["size"], duration),
                f"{name}_delivered_kbit_s": _rate(sent["size"][packet[got]], duration),
                **spread(by_kind[name], f"{name}_latency", "ms"),
            }
        return Answer(
            numbers=numbers, panel=lambda axes: draw_distribution(axes, by_kind, "latency [ms]")
        )


def unique_packets(recording: Recording, signal: str) -> Array:
    """All packets but noise, each once, by ascending id, `PACKET` records, shape (packet,)."""
    table = table_of(recording, signal, "PKTS", PACKET).records
    _, first = np.unique(table["id"], return_index=True)
    return np.asarray(table[first])


def deliveries(recording: Recording, receptions: str, sent: Array) -> tuple[Array, Array]:
    """First receptions of packets where they were to go.

    Args:
        recording: of a run.
        receptions: `component.connector`.
        sent: as `unique_packets` returns it.

    Returns:
        `RECEPTION` records, and the index into `sent` of the packet of each, shape (n,) both.

    Raises:
        ValueError: a packet was received that nobody sent.
    """
    heard = received(recording, receptions, "any").records
    if len(heard) == 0:
        return heard, np.empty(0, np.int64)
    packet = np.searchsorted(sent["id"], heard["packet"])
    is_known = packet < len(sent)
    is_known[is_known] = sent["id"][packet[is_known]] == heard["packet"][is_known]
    if not is_known.all():
        unknown = heard["packet"][~is_known][0]
        raise ValueError(f"`{receptions}` has packet {unknown}, which nobody sent")
    destination = sent["destination"][packet]
    rows = np.flatnonzero((destination == NO_VEHICLE) | (destination == heard["receiver"]))
    order = rows[np.argsort(heard["time"][rows], kind="stable")]
    at = (packet[order] << 32) + heard["receiver"][order]
    _, first = np.unique(at, return_index=True)
    chosen = order[first]
    return heard[chosen], packet[chosen]


def _rate(sizes: Array, duration: float) -> float | None:
    """What messages of `sizes` [byte] make in `duration` [s], in kbit/s."""
    return float(sizes.sum(dtype=np.int64)) * 8e-3 / duration if duration > 0 else None
