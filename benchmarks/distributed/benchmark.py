"""`nlosim bench distributed`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from typing_extensions import override

from adapters.zenoh import ZenohTransport
from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.distributed.bare_zenoh import open_session_hub
from benchmarks.distributed.helics import Helics
from benchmarks.distributed.hub import HubParticipant
from benchmarks.distributed.mosaik import Mosaik
from benchmarks.distributed.ours import Ours
from benchmarks.distributed.participant import Participant, RingRun, missing
from benchmarks.distributed.pipe import open_pipes
from benchmarks.distributed.ring import PARALLEL, SEQUENTIAL, Ring
from benchmarks.distributed.zeromq import open_router
from benchmarks.settings import whole_number
from benchmarks.spread import Spread
from orchestrator.remote.local import LocalTransport

PARTICIPANTS: Final[Mapping[str, Participant]] = {
    "local": Ours("nlosim, local", LocalTransport),
    "zenoh": Ours("nlosim, zenoh", ZenohTransport),
    "helics": Helics(),
    "mosaik": Mosaik(),
    "zeromq": HubParticipant("ZeroMQ", open_router, why_not=missing("zmq", "pyzmq")),
    "bare-zenoh": HubParticipant("Zenoh", open_session_hub, most=5),
    "pipe": HubParticipant("Pipe", open_pipes, most=5),
}

RINGS: Final = (
    *(
        Ring(size, kind)
        for kind in (PARALLEL, SEQUENTIAL)
        for size in (256, 12800, 102400, 1048576)
    ),
    *(Ring(12800, PARALLEL, members) for members in (20, 50)),
)
OURS: Final = {
    "local": ("helics", "mosaik", "zeromq", "pipe"),
    "zenoh": ("zeromq", "bare-zenoh", "helics"),
}
"""The peers with which each of our transports is compared."""

TARGET_MS: Final = 0.4
"""What is aimed at for a step of five over `local`, in parallel, up to 100 KB [ms]."""

_STEPS: Final = "steps"
_UNIT: Final = "ms / step"
_Measured: TypeAlias = Mapping[str, Sequence[Measurement]]


class DistributedBenchmark(Benchmark):
    """Rings of processes that hand on arrays: ours beside other ways to do that."""

    def __init__(self) -> None:
        self._steps = 500

    @property
    @override
    def description(self) -> str:
        return (
            "rings of 5, 20 and 50 processes that hand on arrays of 256 B to 1 MB: milliseconds of "
            "wall time per macro step, mean of a run, start and end excluded"
        )

    @property
    @override
    def peer(self) -> str:
        absent = [
            f"{each.label} ({each.why_not})" for each in PARTICIPANTS.values() if each.why_not
        ]
        left_out = f"; left out: {', '.join(absent)}" if absent else ""
        return (
            "the same ring, measured in turn, all last values compared: HELICS (zmq), mosaik "
            "(remote simulators), and loops without a framework over ZeroMQ, Zenoh and pipes of "
            f"`multiprocessing`{left_out}"
        )

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return {_STEPS: str(self._steps)}

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        self._steps = whole_number(settings, _STEPS, 20)

    @override
    def cases(self) -> Mapping[str, Case]:
        return {
            f"{ring.name}/{name}": RingRun(
                participant=each, ring=ring, steps=_share(self._steps, ring, each)
            )
            for ring in RINGS
            for name, each in PARTICIPANTS.items()
            if not each.why_not and ring.members <= each.most
        }

    @override
    def rows(self, measured: _Measured) -> Sequence[Row]:
        return [
            row
            for ring in RINGS
            for ours, peers in OURS.items()
            for row in _rows(ring, ours, peers, measured)
        ]


def _share(steps: int, ring: Ring, participant: Participant) -> int:
    """How many steps are timed: those that take long are made less often."""
    slow = (5 if ring.size > 500_000 else 1) * (ring.members // 5)
    return max(round(participant.share * steps / slow), 10)


def _rows(ring: Ring, ours: str, peers: Sequence[str], measured: _Measured) -> Iterator[Row]:
    """Ours beside each peer that was measured, or alone."""
    found = measured.get(f"{ring.name}/{ours}")
    if not found:
        return
    spread = Spread.of(each["mean_ms"] for each in found)
    details = {**_middle(found), **({"target_ms": TARGET_MS} if _is_aimed_at(ring, ours) else {})}
    there = [peer for peer in peers if f"{ring.name}/{peer}" in measured]
    if not there:
        yield Row.of(f"{ring.name}/{ours}", spread, _UNIT, is_higher_better=False, details=details)
    for peer in there:
        runs = measured[f"{ring.name}/{peer}"]
        theirs = Spread.of(each["mean_ms"] for each in runs)
        target = target_ratio(ring, ours, peer)
        yield Row.of(
            f"{ring.name}/{ours}/{peer}",
            spread,
            _UNIT,
            peer=theirs.median,
            peer_name=PARTICIPANTS[peer].label,
            is_higher_better=False,
            details={
                **({} if target is None else {"target_ratio": target}),
                **details,
                **{f"peer_{name}": value for name, value in _middle(runs).items()},
                "peer_low_ms": theirs.low,
                "peer_high_ms": theirs.high,
            },
        )


def target_ratio(ring: Ring, ours: str, peer: str) -> float | None:
    """How many times faster than a peer it should be at least, if anything is aimed at."""
    if ring.members == 50:
        return 1 / 1.5 if (ours, peer) == ("local", "zeromq") else None
    return {("local", "helics"): 2.0, ("zenoh", "zeromq"): 1 / 2.5}.get((ours, peer))


def _is_aimed_at(ring: Ring, ours: str) -> bool:
    return (
        ours == "local" and ring.members == 5 and ring.algorithm == PARALLEL and ring.size <= 102400
    )


def _middle(runs: Sequence[Measurement]) -> dict[str, float]:
    return {name: Spread.of(each[name] for each in runs).median for name in ("median_ms", "p99_ms")}
