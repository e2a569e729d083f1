"""`nlosim bench scene`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from typing_extensions import override

import scenarios
from adapters.sumo.parameters import TrafficParameters
from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.scene import work
from benchmarks.scene.process import apart
from benchmarks.settings import whole_number
from benchmarks.spread import Spread

_FOLDER: Final = Path(scenarios.__file__).parent
_SCENE: Final = _FOLDER / "assets" / "city" / "city.sumocfg"
_STEP: Final = 0.1
"""The step of SUMO and of the traffic component [s], as in the scenario."""

_COUNTS: Final = (100, 300, 1000)
_DEMAND: Final = 1000
"""Vehicles of the scene's demand, which is scaled to fewer."""

_TARGETS: Final = MappingProxyType({"radios/300": 5.0, "radios/1000": 1.0})
"""Simulated seconds per second of wall time that the project aims at, on two cores."""

_SECONDS: Final = "seconds"
_WALL: Final = "simulated s / s"
_CPU: Final = "simulated s / CPU s"
_SUMO: Final = "SUMO alone"
_TRANSPORT: Final = "zenoh"
"""Traffic steps in a process of its own, beside the other components."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CityRun(Case):
    """One run of a scenario of the city, recorded; traffic in a process of its own.

    Attributes:
        scenario: its name.
        vehicles: how many are there from the first second on.
        seconds: simulated [s].
    """

    scenario: str
    vehicles: int
    seconds: int

    @override
    def measure(self) -> Measurement:
        """Run once in a new process; see `work.run`."""
        scale = f"components.traffic.parameters.scale={self.vehicles / _DEMAND}"
        settings = [f"time.stop={self.seconds} s", scale]
        return apart(work.run, _FOLDER / f"{self.scenario}.yaml", settings, _TRANSPORT)


@dataclass(frozen=True, kw_only=True, eq=False)
class Adapter(Case):
    """The traffic component alone, and after it SUMO alone, with the same scene and options.

    Attributes:
        vehicles: how many are there from the first second on.
        seconds: simulated [s].
    """

    vehicles: int
    seconds: int

    @override
    def measure(self) -> Measurement:
        """Step both, each in a new process.

        Returns:
            `cpu_s` of the component and `sumo_cpu_s` of SUMO alone, set-up excluded, and
            `simulated_s`.
        """
        scale = self.vehicles / _DEMAND
        parameters = TrafficParameters(scene=_SCENE, step_length=_STEP, scale=scale)
        steps = round(self.seconds / _STEP)
        ours = apart(work.adapter, parameters, steps)
        bare = apart(work.sumo, parameters, steps)
        return {"cpu_s": ours["cpu_s"], "sumo_cpu_s": bare["cpu_s"], "simulated_s": self.seconds}


class SceneBenchmark(Benchmark):
    """Runs of the city with 100 to 1000 vehicles, and of its traffic alone."""

    def __init__(self) -> None:
        self._seconds = 20

    @property
    @override
    def description(self) -> str:
        return (
            "a city of 100 to 1000 vehicles with radios at 10 Hz, recorded: simulated seconds per "
            "second and per CPU second; its traffic component alone: per CPU second"
        )

    @property
    @override
    def peer(self) -> str:
        return (
            "of `radios` the targets of the project, on two cores; of `traffic` the bare steps of "
            "SUMO with the same scene and options (libsumo), measured in turn, set-up excluded in "
            "both"
        )

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return {_SECONDS: str(self._seconds)}

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        self._seconds = whole_number(settings, _SECONDS, 1)

    @override
    def cases(self) -> Mapping[str, Case]:
        seconds = self._seconds
        found: dict[str, Case] = {
            f"radios/{count}": CityRun(scenario="city", vehicles=count, seconds=seconds)
            for count in _COUNTS
        }
        found["lidars/300"] = CityRun(scenario="city_lidars", vehicles=300, seconds=seconds)
        for count in _COUNTS:
            found[f"traffic/{count}"] = Adapter(vehicles=count, seconds=seconds)
        return found

    @override
    def rows(self, measured: Mapping[str, Sequence[Measurement]]) -> Sequence[Row]:
        return list(_rows(measured))


def _rows(measured: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    for case, repetitions in measured.items():
        per_cpu = Spread.of(_speed(each, "cpu_s") for each in repetitions)
        if "sumo_cpu_s" in repetitions[0]:
            bare = Spread.of(_speed(each, "sumo_cpu_s") for each in repetitions)
            details = {"peer_low": bare.low, "peer_high": bare.high}
            yield Row.of(case, per_cpu, _CPU, peer=bare.median, peer_name=_SUMO, details=details)
        else:
            spread = Spread.of(_speed(each, "wall_s") for each in repetitions)
            target = _TARGETS.get(case)
            details = {"simulated_s_per_cpu_s": per_cpu.median, **_details(repetitions)}
            yield Row.of(case, spread, _WALL, peer=target, peer_name="target", details=details)


def _speed(measurement: Measurement, clock: str) -> float:
    return measurement["simulated_s"] / measurement[clock]


def _details(repetitions: Sequence[Measurement]) -> Mapping[str, float]:
    """Medians; of what grows with the time, per simulated second."""
    found = {}
    for name in repetitions[0]:
        if name in ("cpu_s", "wall_s", "simulated_s"):
            continue
        median = Spread.of(each[name] for each in repetitions).median
        if name == "recorded_bytes":
            found["recorded_mb_per_s"] = median / repetitions[0]["simulated_s"] / 1e6
        elif name.endswith("_s") and name != "loading_s":
            found[f"{name}_per_s"] = median / repetitions[0]["simulated_s"]
        else:
            found[name] = median
    return found
