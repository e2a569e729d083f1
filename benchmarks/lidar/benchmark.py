"""`nlosim bench lidar`."""

from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.lidar.case import CastingRun, EverythingRun, Workload
from benchmarks.lidar.embree import embree_version, require_embree
from benchmarks.lidar.pattern import Pattern
from benchmarks.spread import Spread

WORKLOADS: Final = (
    Workload(name="64x1024"),
    Workload(name="64x1024-tilted", pattern=Pattern(pitch=0.05, roll=0.03)),
    Workload(name="64x1024-100m", pattern=Pattern(reach=100.0)),
    Workload(name="32x1024", pattern=Pattern(channels=32)),
    Workload(name="128x2048", pattern=Pattern(channels=128, azimuths=2048)),
    Workload(name="10x64x1024-500", vehicles=500, sensors=10),
)
"""Channels x azimuths, 100 vehicles and 20 buildings; the last one is ten sensors among 500."""

TARGETS: Final[Mapping[str, float]] = {
    "casting/64x1024": 0.5,
    "casting/64x1024-tilted": 1.0,
    "everything/64x1024": 2.0,
    "everything/64x1024-tilted": 2.0,
    "everything/10x64x1024-500": 20.0,
}
"""What was aimed at [ms]."""

PEER: Final = "Embree"
UNIT: Final = "ms / scan"
_Measured: TypeAlias = Mapping[str, Sequence[Measurement]]


class LidarBenchmark(Benchmark):
    """Casting alone, beside Embree; and all that a simulation does with the lidar."""

    @property
    @override
    def description(self) -> str:
        return (
            "the lidar FMU in a town of 300 m x 300 m in which every vehicle moves between two "
            "scans; CPU milliseconds per scan of all sensors"
        )

    @property
    @override
    def peer(self) -> str:
        return (
            f"Embree 4 ({embree_version()}), float32 triangles of the same prisms, timed in turn "
            "with ours; one thread; triangles and rays made beforehand, the scene of the vehicles "
            "built anew for each scan"
        )

    @override
    def require(self) -> None:
        require_embree()

    @override
    def cases(self) -> Mapping[str, Case]:
        casters = {"nlosim": True, "embree": False}
        casting = {
            f"casting/{workload.name}/{caster}": CastingRun(workload=workload, ours=ours)
            for workload in WORKLOADS
            for caster, ours in casters.items()
        }
        everything = {f"everything/{w.name}": EverythingRun(workload=w) for w in WORKLOADS}
        return {**casting, **everything}

    @override
    def rows(self, measured: _Measured) -> Sequence[Row]:
        found = []
        for workload in WORKLOADS:
            name = f"casting/{workload.name}"
            if f"{name}/nlosim" in measured:
                found.append(_casting(name, measured))
        for workload in WORKLOADS:
            name = f"everything/{workload.name}"
            if name in measured:
                found.append(_everything(name, measured[name]))
        return found


def _casting(name: str, measured: _Measured) -> Row:
    ours = Spread.of(run["cpu_ms"] for run in measured[f"{name}/nlosim"])
    details = {"scene_ms": Spread.of(r["scene_ms"] for r in measured[f"{name}/nlosim"]).median}
    peer = None
    if theirs := measured.get(f"{name}/embree"):
        spread = Spread.of(run["cpu_ms"] for run in theirs)
        peer = spread.median
        details |= {"peer_low_ms": spread.low, "peer_high_ms": spread.high}
    return Row.of(
        name,
        ours,
        UNIT,
        peer=peer,
        peer_name=PEER,
        is_higher_better=False,
        details=_target(name) | details,
    )


def _everything(name: str, runs: Sequence[Measurement]) -> Row:
    spread = Spread.of(run["cpu_ms"] for run in runs)
    return Row.of(
        name,
        spread,
        UNIT,
        is_higher_better=False,
        details=_target(name)
        | {
            key: Spread.of(run[key] for run in runs).median
            for key in ("fmu_ms", "start_ms", "points")
        },
    )


def _target(name: str) -> dict[str, float]:
    return {"target_ms": TARGETS[name]} if name in TARGETS else {}
