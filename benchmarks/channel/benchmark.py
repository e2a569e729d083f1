"""`nlosim bench channel`."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias, TypeVar

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.channel.case import ChannelRun
from benchmarks.channel.exponent import exponent_rows
from benchmarks.channel.layout import DATA
from benchmarks.channel.split import split_rows
from benchmarks.channel.workload import Workload, cross44, grid, grid200
from benchmarks.spread import Spread

_RADIO: Final[Mapping[str, Any]] = {
    "carrier_frequency": 5.89e9,
    "transmit_power": 26.0,
    "noise_floor": -98.0,
    "sensitivity": -94.0,
    "cca_threshold": -65.0,
    "bitrate": 6e6,
    "maximum_range": 2600.0,
}
"""Parameters of the channel, as in the runs of Veins."""

_SHADOWING: Final = {
    "free": (False, False),
    "buildings": (True, False),
    "vehicles": (False, True),
    "buildings+vehicles": (True, True),
}
"""Whether buildings and vehicles attenuate."""

_PEER_MODELS: Final = {
    "free": "free space",
    "buildings": "free space + buildings",
    "vehicles": "free space + vehicles",
    "buildings+vehicles": "free space + buildings + vehicles",
}
"""What is modelled in the cases of `_SHADOWING`, in the words of the file with Veins' figures."""

_FULL: Final = "buildings+vehicles"

_REPORTED: Final = {"noticed": False, "all": True}
"""Which receptions are reported: those from the sensitivity on, as in the statistics of Veins, or
the weaker ones too (`weak_receptions`)."""

_STAGES: Final = {
    "silent": f"{_FULL}/silent",
    "free": "free/all",
    "buildings": "buildings/all",
    "full": f"{_FULL}/all",
}
"""Cases from which the split of the time is computed; see `Stages`."""

GROWTH: Final = (50, 100, 200, 500, 1000)
"""Vehicles."""

PEER: Final = "Veins 5.3.1"
_Key = TypeVar("_Key")
_Measured: TypeAlias = Mapping[str, Sequence[Measurement]]

UNIT: Final = "simulated s / CPU s"


class ChannelBenchmark(Benchmark):
    """The workloads that Veins was timed with, and a grid that grows at constant density."""

    @property
    @override
    def description(self) -> str:
        return (
            "the channel FMU in its importer, every vehicle sending 1600 bit at 10 Hz; simulated "
            "seconds per CPU second, set-up included"
        )

    @property
    @override
    def peer(self) -> str:
        found = _veins()
        return f"{PEER}, timed once elsewhere. {found['machine']}. {found['build']}"

    @override
    def cases(self) -> Mapping[str, Case]:
        return dict((*_beside_veins(), *_growing()))

    @override
    def rows(self, measured: _Measured) -> Sequence[Row]:
        peers = _peers()
        found = [_row(name, runs, peers.get(_peer_key(name))) for name, runs in measured.items()]
        for reported in _REPORTED:
            sizes = {n: f"grid/{n}/veins/{_FULL}/{reported}" for n in GROWTH}
            if runs := _all_of(sizes, measured):
                found += exponent_rows(f"growth/{reported}", runs)
        for workload in ("cross44", "grid200"):
            stages = {stage: f"{workload}/veins/{case}" for stage, case in _STAGES.items()}
            if staged := _all_of(stages, measured):
                found += split_rows(f"split/{workload}", staged)
        return found


def _all_of(names: Mapping[_Key, str], measured: _Measured) -> Mapping[_Key, Sequence[Measurement]]:
    """The measurements of the cases `names`; nothing if one is missing."""
    if not all(name in measured for name in names.values()):
        return {}
    return {key: measured[name] for key, name in names.items()}


def _beside_veins() -> Iterator[tuple[str, ChannelRun]]:
    for workload in (cross44(), grid200()):
        for shadowing in _SHADOWING:
            for reported in _REPORTED:
                yield _run(workload, "veins", shadowing, reported)
        for reported in _REPORTED:
            yield _run(workload, "nlosim", _FULL, reported)
        yield _run(workload, "veins", _FULL, "noticed", silent=True)


def _growing() -> Iterator[tuple[str, ChannelRun]]:
    for count in GROWTH:
        workload = grid(count)
        for reported in _REPORTED:
            yield _run(workload, "veins", _FULL, reported)


def _run(
    workload: Workload, model: str, shadowing: str, reported: str, *, silent: bool = False
) -> tuple[str, ChannelRun]:
    """A case and its name."""
    buildings, vehicles = _SHADOWING[shadowing]
    last = "silent" if silent else reported
    return f"{workload.name}/{model}/{shadowing}/{last}", ChannelRun(
        workload=workload,
        parameters={
            **_RADIO,
            "model": model,
            "building_shadowing": buildings,
            "vehicle_shadowing": vehicles,
            "weak_receptions": _REPORTED[reported],
            "threads": 1,  # as Veins
        },
        silent=silent,
    )


def _veins() -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads((DATA / "veins.json").read_text(encoding="utf-8"))
    return found


def _peers() -> Mapping[tuple[str, str], float]:
    """Simulated seconds per CPU second of Veins, by workload and shadowing."""
    names = {models: ours for ours, models in _PEER_MODELS.items()}
    return {
        (row["scenario"], names[row["models"]]): row["sim_s_per_cpu_s"] for row in _veins()["rows"]
    }


def _peer_key(case: str) -> tuple[str, str]:
    """Whose figure a case is compared with; a silent one, and one that grows, with nobody's."""
    workload, *_, shadowing, reported = case.split("/")
    return (workload, shadowing if reported in _REPORTED else reported)


def _row(name: str, runs: Sequence[Measurement], peer: float | None) -> Row:
    speed = Spread.of(run["simulated_s"] / run["total_s"] for run in runs)
    return Row.of(
        name,
        speed,
        UNIT,
        peer=peer,
        peer_name=PEER,
        details=_details(runs),
    )


def _details(runs: Sequence[Measurement]) -> dict[str, float]:
    """The run with the median time, taken apart."""
    run = sorted(runs, key=lambda run: run["total_s"])[(len(runs) - 1) // 2]
    deliveries = run["packets"] * (run["vehicles"] - 1)
    per_delivery = {"cpu_ns_per_delivery": 1e9 * run["total_s"] / deliveries} if deliveries else {}
    return {
        "cpu_s": run["total_s"],
        "fmu_cpu_s": run["fmu_s"],
        "setup_cpu_s": run["setup_s"],
        "wall_s": run["wall_s"],
        "packets": run["packets"],
        "receptions": run["receptions"],
        "received": run["R"],
        **per_delivery,
    }
