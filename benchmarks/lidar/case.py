"""Runs of the lidar and of its peer, and the CPU time they take."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter, process_time_ns
from typing import Any, Final, Protocol

import numpy as np
from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.lidar.caster import Caster
from benchmarks.lidar.embree import Embree
from benchmarks.lidar.pattern import DEFAULT, Pattern
from benchmarks.lidar.town import INTERVAL, SCANS, Town, town
from benchmarks.step_clock import step_clock
from fmus.messages.records import POINT, SENSOR, unframe
from orchestrator import registry
from orchestrator.parameters import ComponentType
from orchestrator.signal import Causality, Signal
from orchestrator.timebase import nanoseconds

_COMPONENT_TYPE: Final = "lidar"
_NS_PER_MS: Final = 1e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Workload:
    """Attributes: the last part of the names of its cases, what is there, and what looks at it."""

    name: str
    vehicles: int = 100
    sensors: int = 1
    pattern: Pattern = DEFAULT

    @cached_property
    def town(self) -> Town:
        """The vehicles and buildings."""
        return town(self.vehicles, self.sensors)


class RayCaster(Protocol):
    """What casts rays in one scene after the other."""

    @abstractmethod
    def show(self, scan: int) -> None:
        """Move all vehicles to where they are in a scan."""

    @abstractmethod
    def cast(self, scan: int, sensor: int) -> None:
        """Trace all rays of one sensor, in the scene that is shown."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CastingRun(Case):
    """Rays alone: no noise, no packing, no importer.

    Attributes:
        workload: what is scanned.
        ours: by the lidar unit, or by the peer.
    """

    workload: Workload
    ours: bool

    @override
    def measure(self) -> Measurement:
        """Scan the town `SCANS` times.

        Returns:
            `cpu_ms` per scan of all sensors; of it `scene_ms` for moving the vehicles. What Embree
            builds, it builds when the first ray comes.
        """
        caster = self._caster
        caster.show(0)
        for sensor in range(self.workload.sensors):
            caster.cast(0, sensor)  # the memory is there, and warm
        begin, moving = process_time_ns(), 0
        for scan in range(SCANS):
            before = process_time_ns()
            caster.show(scan)
            moving += process_time_ns() - before
            for sensor in range(self.workload.sensors):
                caster.cast(scan, sensor)
        spent = process_time_ns() - begin
        return {"cpu_ms": spent / SCANS / _NS_PER_MS, "scene_ms": moving / SCANS / _NS_PER_MS}

    @cached_property
    def _caster(self) -> RayCaster:
        kind = Caster if self.ours else Embree
        return kind(self.workload.town, self.workload.pattern)


@dataclass(frozen=True, kw_only=True, eq=False)
class EverythingRun(Case):
    """The installed component type `lidar`, as a simulation runs it, with its noise.

    Attributes:
        workload: what is scanned.
    """

    workload: Workload

    @override
    def measure(self) -> Measurement:
        """Create the component and scan the town `SCANS` times.

        Returns:
            `cpu_ms` per scan of all sensors, from inputs to the signal `points`; of it `fmu_ms` in
            the FMU. `start_ms`: from creating the component to its first points, wall time.
            `points` per scan.
        """
        component_type = self._component_type
        inputs = [{**self._start_values, **given} for given in self.workload.town.inputs()]
        begin = perf_counter()
        component = component_type.create(_COMPONENT_TYPE, self.workload.pattern.parameters())
        try:
            component.setup(0, np.random.default_rng(1))
            component.initialise(inputs[0])
            component.outputs()
            start = perf_counter() - begin
            h, points = nanoseconds(str(INTERVAL)), 0
            component.step(inputs[-1], 0, h)
            component.outputs()  # the memory is there, and warm
            before = process_time_ns()
            with step_clock() as clock:
                for scan, given in enumerate(inputs, start=1):
                    component.step(given, scan * h, h)
                    found = component.outputs()["points"]
                    points += _points(found)
            spent = process_time_ns() - before
        finally:
            component.close()
        return {
            "cpu_ms": spent / SCANS / _NS_PER_MS,
            "fmu_ms": clock.spent / SCANS / _NS_PER_MS,
            "start_ms": start * 1e3,
            "points": points / SCANS,
        }

    @cached_property
    def _component_type(self) -> ComponentType:
        """Looked up once: the time that takes depends on what else is installed."""
        return registry.component_type(_COMPONENT_TYPE)

    @cached_property
    def _start_values(self) -> Mapping[str, Signal]:
        parameters: Mapping[str, Any] = self.workload.pattern.parameters()
        created = self._component_type.create(_COMPONENT_TYPE, parameters)
        return {
            name: connector.start_value()
            for name, connector in created.connectors.items()
            if connector.causality is Causality.INPUT
        }


def _points(signal: Signal) -> int:
    """How many points there are."""
    assert isinstance(signal, bytes)  # noqa: S101 - the connector says so
    sensors = unframe("LPTS", signal, SENSOR)
    count = int(sensors["count"].sum())
    assert len(signal) >= count * POINT.itemsize  # noqa: S101
    return count
