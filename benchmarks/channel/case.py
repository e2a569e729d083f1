"""One run of the channel, and the CPU time it takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter, process_time_ns
from typing import Any

import numpy as np
from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.channel.workload import Workload
from benchmarks.step_clock import step_clock
from fmus.messages.records import OUTCOMES, RECEPTION, unframe
from orchestrator import registry
from orchestrator.errors import ComponentError, CosimError
from orchestrator.parameters import ComponentType
from orchestrator.signal import Causality, Signal
from orchestrator.timebase import NANOSECONDS_PER_SECOND, seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class ChannelRun(Case):
    """A workload, driven through the installed component type `channel`.

    Attributes:
        workload: what the channel is given.
        parameters: of the component.
        silent: nobody sends: the cost of the scenes and of the importer alone.
        component_type: by the name under which it is installed.
    """

    workload: Workload
    parameters: Mapping[str, Any]
    silent: bool = False
    component_type: str = "channel"

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `total_s`: CPU time of everything from creating the component (the FMU is unpacked and
            loaded) to closing it, outputs read and receptions counted; of it `setup_s` until the
            first step and `fmu_s` in the steps of the FMU. `wall_s`; `simulated_s`; `vehicles`;
            `packets`; `receptions`, and of them each outcome by its letter.
        """
        grid = self.workload.grid
        component_type, name = self._component_type, self.component_type
        inputs = list(self.workload.inputs(self._start_values, silent=self.silent))
        packets = 0 if self.silent else self.workload.sent
        outcomes = np.zeros(len(OUTCOMES), np.int64)
        wall = perf_counter()
        begin = process_time_ns()
        with step_clock() as clock:
            component = component_type.create(name, self.parameters)
            time = grid.start
            try:
                component.setup(grid.start, np.random.default_rng(1))
                component.initialise({**inputs[0], "packets": b""})
                ready = process_time_ns()
                for time, given in zip(grid, inputs, strict=True):
                    component.step(given, time, grid.after(time) - time)
                    outcomes += _outcomes(component.outputs()["receptions"])
            except CosimError as error:
                raise ComponentError(name, time, str(error)) from error
            finally:
                component.close()
        end = process_time_ns()
        return {
            "total_s": (end - begin) / NANOSECONDS_PER_SECOND,
            "setup_s": (ready - begin) / NANOSECONDS_PER_SECOND,
            "fmu_s": clock.spent / NANOSECONDS_PER_SECOND,
            "wall_s": perf_counter() - wall,
            "simulated_s": seconds(self.workload.duration),
            "vehicles": self.workload.layout.vehicles,
            "packets": packets,
            "receptions": int(outcomes.sum()),
            **{letter: int(n) for letter, n in zip(OUTCOMES, outcomes, strict=True)},
        }

    @cached_property
    def _component_type(self) -> ComponentType:
        """Looked up once: the time that takes depends on what else is installed."""
        return registry.component_type(self.component_type)

    @cached_property
    def _start_values(self) -> Mapping[str, Signal]:
        """Start values of all inputs, asked for once: the same objects are not set again."""
        created = self._component_type.create(self.component_type, self.parameters)
        return {
            name: connector.start_value()
            for name, connector in created.connectors.items()
            if connector.causality is Causality.INPUT
        }


def _outcomes(receptions: Signal) -> np.ndarray:
    """How many receptions there were of each outcome."""
    assert isinstance(receptions, bytes)  # noqa: S101 - the connector says so
    records = unframe("RCPT", receptions, RECEPTION)
    return np.bincount(records["outcome"], minlength=len(OUTCOMES))
