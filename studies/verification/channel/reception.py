"""`nist_error_rate.csv` and `min_sinr.json`: what a receiver makes of a frame.

*Error rates* are probabilities that parts of a frame are decoded, at given SNIR. The channel is
asked through links whose length makes the wanted SNIR in free space. A link gives the probabilities
of the header and of the payload, which has 16 + n + 6 bits for n bits of the packet; for bits that
are independent, those of n bits alone follow exactly, as the power n / (n + 22) of the latter.

*The lowest SNIR* of a frame while other frames come and go is found with real frames on air: the
receiver in the centre of a circle, every transmitter on it, so that all delays are equal, and near
enough to be free of loss. The reference frame is a packet; interferers are noise with given start,
duration, power and channel, whose numbers are steps of 5 MHz (IEEE 802.11-2020, 17.3.8.4.2).
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import BSM, NO_VEHICLE, NOISE, PACKET
from fmus.physics.propagation import SPEED_OF_LIGHT
from orchestrator.signal import Array
from orchestrator.timebase import Duration
from studies.verification.channel.check import Case, Question, ValueCheck
from studies.verification.channel.golden_files import (
    Node,
    Table,
    number,
    read_json,
    read_table,
    whole,
)
from studies.verification.channel.session import (
    MICROSECOND,
    MILLISECOND,
    ChannelUnderTest,
    link_inputs,
    vehicle_inputs,
)
from studies.verification.channel.tolerances import PROBABILITY, SNIR

ERROR_RATE: Final = "nist_error_rate.csv"
MIN_SNIR: Final = "min_sinr.json"
BITRATES: Final = (3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6, 27e6)
"""Bit rates of a 10 MHz channel [bit/s]; IEEE 802.11-2020, table 17-4."""
_COLUMNS: Final = ("chunk_success", "header_success", "payload_success", "packet_success")
_SERVICE_AND_TAIL: Final = 22  # bits, IEEE 802.11-2020, 17.3.2
_CARRIER: Final = 5.9e9
_POWER: Final = 26.0
_NOISE: Final = -98.0
_LOSS_AT_1_M: Final = 20 * np.log10(4 * np.pi * _CARRIER / SPEED_OF_LIGHT)
_PREAMBLE: Final = 32  # not decoded [us]; IEEE 802.11-2020, table 17-4
_RADIUS: Final = 50.0
_RECEIVER: Final = 0
_ON_AIR: Final[Mapping[str, Any]] = {
    "transmit_power": 0.0,
    "sensitivity": -200.0,  # every frame is tried
    "medium_access": False,
    "frame_capture": False,
    "lossless_distance": 2 * _RADIUS,
    "vehicle_shadowing": False,
}
"""Parameters of an instance that receives a frame among others."""


def success(
    channel: ChannelUnderTest, snir_db: Array, size: Array, bitrate: float
) -> tuple[Array, Array]:
    """Ask with which probabilities the header and the payload of frames are decoded.

    Args:
        channel: is asked.
        snir_db: SNIR over the whole frame [dB], shape (n,).
        size: of the packets [byte], shape (n,).
        bitrate: of the payload [bit/s].

    Returns:
        Probabilities of the header and of the payload [1], shape (n,) both.
    """
    parameters: dict[str, Any] = {
        "carrier_frequency": _CARRIER,
        "transmit_power": _POWER,
        "noise_floor": _NOISE,
        "bitrate": bitrate,
        "mac_header": 0,
        "band_edges": False,  # the SNIR is wanted exactly, at one frequency
    }
    distance = 10 ** ((_POWER - _NOISE - _LOSS_AT_1_M - snir_db) / 20)
    receiver = np.zeros((len(distance), 3))
    receiver[:, 0] = distance
    probes = link_inputs(np.zeros_like(receiver), receiver, size=size)
    with channel.start(parameters, probes) as session:
        return session.probed("header_success"), session.probed("payload_success")


@dataclass(frozen=True, slots=True, kw_only=True)
class _FramesOfRate(Question):
    """Asks for all probabilities of frames of one bit rate, column by column.

    Attributes:
        snir: [dB], shape (frame,).
        bits: of each packet, shape (frame,).
        bitrate: [bit/s].
    """

    snir: Array
    bits: Array
    bitrate: float

    @override
    def ask(self, channel: ChannelUnderTest) -> Array:
        header, payload = success(channel, self.snir, self.bits // 8, self.bitrate)
        chunk = payload ** (self.bits / (self.bits + _SERVICE_AND_TAIL))
        return np.concatenate([chunk, header, payload, header * payload])  # as `_COLUMNS`


def read_error_rate(path: Path) -> ValueCheck:
    """Read probabilities that parts of a frame are decoded; one instance for each bit rate.

    Raises:
        GoldenError: the file is malformed.
    """
    numbers = dict.fromkeys(("bitrate_bps", "snr_db", *_COLUMNS), number)
    table = read_table(path, ERROR_RATE, {**numbers, "mpdu_bits": whole})
    _refuse(table, ~np.isin(table["bitrate_bps"], BITRATES), "bitrate_bps: no rate of 10 MHz")
    bits = table["mpdu_bits"]
    _refuse(table, (bits <= 0) | (bits % 8 != 0), "mpdu_bits: must be a multiple of 8 above 0")
    cases: list[Case] = []
    questions = []
    for bitrate in np.unique(table["bitrate_bps"]).tolist():
        rows = np.flatnonzero(table["bitrate_bps"] == bitrate)
        first = len(cases)
        cases += _cases_of_rate(table, bitrate, rows)
        questions.append(
            _FramesOfRate(
                cases=range(first, len(cases)),
                snir=table["snr_db"][rows],
                bits=bits[rows],
                bitrate=bitrate,
            )
        )
    return ValueCheck(tolerance=PROBABILITY, cases=cases, questions=questions)


def _cases_of_rate(table: Table, bitrate: float, rows: Array) -> Iterator[Case]:
    for column in _COLUMNS:
        for row in rows:
            yield Case(
                place=f"{table.place(row)}: {column}",
                golden=table[column][row],
                series=f"{bitrate / 1e6:g} Mbit/s, {column}",
                x=table["snr_db"][row],
            )


def _refuse(table: Table, is_wrong: Array, what: str) -> None:
    if is_wrong.any():
        raise table.problem(int(np.flatnonzero(is_wrong)[0]), what)


@dataclass(frozen=True, slots=True)
class _Frame:
    """A frame on air.

    Attributes:
        start, duration: [ns].
        power: received [dBm].
        offset: of its channel from that of the reference, in steps of 5 MHz.
    """

    start: int
    duration: int
    power: float
    offset: int


@dataclass(frozen=True, slots=True)
class _Encounter:
    """A frame, and others that come and go meanwhile."""

    noise: float  # [dBm]
    reference: _Frame
    interferers: tuple[_Frame, ...]

    @property
    def span(self) -> tuple[int, int]:
        """The times of the first start and of the last end [ns]."""
        frames = (self.reference, *self.interferers)
        return min(f.start for f in frames), max(f.start + f.duration for f in frames)

    def packets(self, number: int, delay: Duration) -> list[Array]:
        """The frames as PACKET records; the reference has the id `number`."""
        numbers = range(number, number + 1 + len(self.interferers))
        frames = (self.reference, *self.interferers)
        return [
            _packet(k, source, frame, delay)
            for k, (source, frame) in zip(numbers, enumerate(frames, start=1), strict=True)
        ]


def _packet(number: int, source: int, frame: _Frame, delay: Duration) -> Array:
    record = np.zeros((), PACKET)
    record["id"], record["source"], record["destination"] = number, source, NO_VEHICLE
    record["route"] = NO_VEHICLE
    record["time"], record["duration"] = frame.start + delay, frame.duration
    record["power_offset"], record["size"] = frame.power, 1
    record["kind"], record["channel_offset"] = (BSM if source == 1 else NOISE), frame.offset
    return record


@dataclass(frozen=True, slots=True, kw_only=True)
class _LowestSnir(Question):
    """Asks for the lowest SNIR of the references of encounters; NaN where it was not decoded.

    Attributes:
        noise: of the receiver [dBm].
        encounters: one after the other.
    """

    noise: float
    encounters: Sequence[_Encounter]

    @override
    def ask(self, channel: ChannelUnderTest) -> Array:
        packets: list[Array] = []
        references: list[int] = []
        now = 0
        for one in self.encounters:
            references.append(len(packets))
            first, last = one.span
            packets += one.packets(len(packets), now - first)
            now += last - first + MILLISECOND
        records = np.sort(np.array(packets, PACKET), order=("time", "id"))
        transmitters = max(len(one.interferers) for one in self.encounters) + 1
        parameters = {**_ON_AIR, "noise_floor": self.noise}
        with channel.start(parameters, _circle(transmitters)) as session:
            received = session.send(records, h=now + MILLISECOND)
        at_centre = received[received["receiver"] == _RECEIVER]
        found = dict(zip(at_centre["packet"].tolist(), at_centre["snir_db"].tolist(), strict=True))
        return np.array([found.get(number, np.nan) for number in references])


def _circle(transmitters: int) -> Mapping[str, Array]:
    """The receiver in the centre, and transmitters, all headed alike."""
    angle = np.linspace(0, 2 * np.pi, transmitters, endpoint=False)
    front = np.zeros((transmitters + 1, 2))
    front[1:] = _RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    n = len(front)
    return vehicle_inputs(range(n), front, np.zeros(n), np.tile((4.0, 2.0, 1.5), (n, 1)))


def read_min_snir(path: Path) -> ValueCheck:
    """Read the lowest SNIR of frames among others; one instance for each noise floor.

    Raises:
        GoldenError: the file is malformed.
    """
    groups: dict[float, list[tuple[_Encounter, Case]]] = defaultdict(list)
    for node in read_json(path, MIN_SNIR).filled():
        encounter = _encounter(node)
        case = Case(
            place=node.case,
            golden=node["min_sinr_db"].number(),
            series="one frame, up to six others",
        )
        groups[encounter.noise].append((encounter, case))
    cases: list[Case] = []
    questions = []
    for noise, group in groups.items():
        own = range(len(cases), len(cases) + len(group))
        cases += [case for _, case in group]
        encounters = [encounter for encounter, _ in group]
        questions.append(_LowestSnir(cases=own, noise=noise, encounters=encounters))
    return ValueCheck(tolerance=SNIR, cases=cases, questions=questions)


def _encounter(node: Node) -> _Encounter:
    reference = node["ref"]
    start, duration = reference["start_us"].whole(), reference["duration_us"].whole()
    if node["check_from_us"].number() != start + _PREAMBLE:
        raise node["check_from_us"].problem(f"must be {_PREAMBLE} us after `ref.start_us`")
    if node["check_to_us"].number() != start + duration:
        raise node["check_to_us"].problem("must be the end of `ref`")
    channel = reference["channel"].whole()
    return _Encounter(
        noise=_dbm(node["noise_mw"]),
        reference=_frame(reference, channel),
        interferers=tuple(_frame(other, channel) for other in node["interferers"]),
    )


def _frame(node: Node, channel: int) -> _Frame:
    return _Frame(
        start=node["start_us"].whole() * MICROSECOND,
        duration=round(node["duration_us"].positive() * MICROSECOND),
        power=_dbm(node["power_mw"]),
        offset=node["channel"].whole() - channel,
    )


def _dbm(node: Node) -> float:
    return float(10 * np.log10(node.positive()))
