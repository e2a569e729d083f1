"""Packet reception ratio of type 2: of those for whom a packet was."""

from typing import Final

from fmus.messages.records import NO_VEHICLE
from orchestrator.recording.reader import Recording
from studies.measures.bins import share
from studies.measures.delivery import deliveries, unique_packets
from studies.measures.radio import KINDS, Kind

IN_FLIGHT: Final = 50_000_000
"""A packet that was handed over so shortly before the end may still be on its way [ns]."""


def intended_ratio(
    recording: Recording, packets: str, receptions: str, kind: Kind
) -> dict[str, float | int | None]:
    r"""Share of the intended receivers that received a packet.

    $$ PRR_2 = \sum_i S_i / \sum_i Z_i $$

    with $Z_i$ the number of receivers for whom packet $i$ is, and $S_i$ those of them that received
    it (3GPP TR 37.885, "PRR type 2"), on whatever hop: relays are the way, not the aim. For whom a
    packet is, its destination says, which is one; whom a broadcast is for nobody says, so that
    broadcasts are not counted.

    Args:
        recording: of a run.
        packets: `component.connector`.
        receptions: likewise.
        kind: of the messages that count.

    Returns:
        `prr2` with its interval, and `intended`, the sum of $Z_i$; all `None` if packets were not
        recorded, and no ratio if none had a destination.
    """
    if packets not in recording:
        return {**share(0, 0, "prr2"), "intended": None}
    sent = unique_packets(recording, packets)
    times = recording[packets].times
    in_time = sent["time"] <= (int(times[-1]) if len(times) else 0) - IN_FLIGHT
    counts = (sent["destination"] != NO_VEHICLE) & in_time
    if kind != "any":
        counts &= sent["kind"] == KINDS[kind]
    intended = int(counts.sum())
    if intended == 0:
        return {**share(0, 0, "prr2"), "intended": 0}
    found = deliveries(recording, receptions, sent)
    served = sum(int(counts[packet].sum()) for _, packet in found)
    return {**share(served, intended, "prr2"), "intended": intended}
