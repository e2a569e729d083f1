"""`min_sinr.json`: the lowest SNIR of a frame while other frames come and go.

Real frames on air: the receiver in the centre of a circle, every transmitter on it, so that all
delays are equal, and near enough to be free of loss. The reference frame is a packet; interferers
are noise with given start, duration, power and channel, whose numbers are steps of 5 MHz
(IEEE 802.11-2020, 17.3.8.4.2).
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import BSM, NO_VEHICLE, NOISE, PACKET
from orchestrator.signal import Array
from orchestrator.timebase import Duration
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.json_document import Node, read_json
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import MICROSECOND, MILLISECOND, ChannelUnderTest
from studies.verification.channel.tolerances import SNIR, Tolerance

NAME: Final = "min_sinr.json"
_PREAMBLE: Final = 32  # not decoded [us]; IEEE 802.11-2020, table 17-4
_RADIUS: Final = 50.0
_RECEIVER: Final = 0
_PARAMETERS: Final[Mapping[str, Any]] = {
    "transmit_power": 0.0,
    "sensitivity": -200.0,  # every frame is tried
    "medium_access": False,
    "frame_capture": False,
    "lossless_distance": 2 * _RADIUS,
    "vehicle_shadowing": False,
}


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
class _Case:
    noise: float  # [dBm]
    reference: _Frame
    interferers: tuple[_Frame, ...]
    golden: float
    place: str

    @property
    def span(self) -> tuple[int, int]:
        """From the first start to the last end [ns]."""
        frames = (self.reference, *self.interferers)
        return min(f.start for f in frames), max(f.start + f.duration for f in frames)

    def packets(self, number: int, delay: Duration) -> list[Array]:
        """PACKET records; the reference has the id `number`."""
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


@dataclass(frozen=True, slots=True)
class MinSnirCheck(Check):
    """The cases of the file, by the noise."""

    cases: Mapping[float, Sequence[_Case]]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return SNIR

    @property
    @override
    def work(self) -> int:
        return len(self.cases)

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        cases: list[_Case] = []
        ours: list[float] = []
        for noise, group in self.cases.items():
            cases += group
            ours += _lowest_snir(channel, noise, group)
            progress.advance()
        series = Series(
            label="one frame, up to six others",
            golden=np.array([case.golden for case in cases]),
            ours=np.array(ours),
        )
        return Comparison.of_values(SNIR, [case.place for case in cases], [series])


def _lowest_snir(channel: ChannelUnderTest, noise: float, cases: Sequence[_Case]) -> list[float]:
    """Of each case; NaN where the receiver did not decode the reference."""
    packets: list[Array] = []
    references: list[int] = []
    now = 0
    for case in cases:
        references.append(len(packets))
        first, last = case.span
        packets += case.packets(len(packets), now - first)
        now += last - first + MILLISECOND
    records = np.sort(np.array(packets, PACKET), order=("time", "id"))
    transmitters = max(len(case.interferers) for case in cases) + 1
    with channel.start({**_PARAMETERS, "noise_floor": noise}, _circle(transmitters)) as session:
        received = session.send(records, h=now + MILLISECOND)
    at_centre = received[received["receiver"] == _RECEIVER]
    found = dict(zip(at_centre["packet"].tolist(), at_centre["snir_db"].tolist(), strict=True))
    return [found.get(number, float("nan")) for number in references]


def _circle(transmitters: int) -> dict[str, Any]:
    """The receiver in the centre, and transmitters, all headed alike."""
    angle = np.linspace(0, 2 * np.pi, transmitters, endpoint=False)
    front = np.zeros((transmitters + 1, 2))
    front[1:] = _RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    n = len(front)
    return scene.vehicles(range(n), front, np.zeros(n), np.tile((4.0, 2.0, 1.5), (n, 1)))


def read(path: Path) -> MinSnirCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    cases: dict[float, list[_Case]] = defaultdict(list)
    for node in read_json(path, NAME).filled():
        case = _case(node)
        cases[case.noise].append(case)
    return MinSnirCheck(cases)


def _case(node: Node) -> _Case:
    reference = node["ref"]
    start, duration = reference["start_us"].whole(), reference["duration_us"].whole()
    if node["check_from_us"].number() != start + _PREAMBLE:
        raise node["check_from_us"].problem(f"must be {_PREAMBLE} us after `ref.start_us`")
    if node["check_to_us"].number() != start + duration:
        raise node["check_to_us"].problem("must be the end of `ref`")
    channel = reference["channel"].whole()
    return _Case(
        noise=_dbm(node["noise_mw"]),
        reference=_frame(reference, channel),
        interferers=tuple(_frame(other, channel) for other in node["interferers"]),
        golden=node["min_sinr_db"].number(),
        place=f"{NAME}: {node.place} (id {node['id'].value if 'id' in node else '?'})",
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
