"""FMUs as component types: what `fmu:` in a scenario opens."""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from typing_extensions import override

from adapters.fmi.component import FmuComponent, RestorableFmuComponent
from adapters.fmi.connectors import left_out, not_set, parameters
from adapters.fmi.description import FmuDescription, read_description
from adapters.fmi.fmi2 import Fmi2Instance
from adapters.fmi.fmi3 import Fmi3Instance
from adapters.fmi.kind import Kind
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.model_exchange.making import integrated, integration_text
from adapters.fmi.options import (
    RETRY_HINT,
    Options,
    Said,
    check_options,
    may_retry,
    option_parameters,
    recordable,
    with_options,
)
from adapters.fmi.settings import settings, start_settings
from adapters.fmi.sizes import Sizes
from adapters.fmi.starts import start_parameters, started
from adapters.fmi.step_size import step_problem
from adapters.fmi.stepping import Stepper
from adapters.fmi.unpacked import check_binary
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import ComponentType, Parameter
from orchestrator.timebase import StepSize


class FmuComponentType(ComponentType):
    """An FMI 2.0 or 3.0 FMU, for Co-Simulation, Model Exchange or Scheduled Execution.

    Parameters are those of the FMU, and the structural parameters that are not the length of
    an input. A structural parameter `n_vehicle` is the axis `vehicle` of its arrays; if it is
    tunable and an input has the axis, it follows that input. An Enumeration is set by the name
    of an item. An integer parameter `seed` that is not set is drawn from the component's random
    stream. A triggered clock is a Boolean that says whether it ticks.
    """

    def __init__(self, path: Path, *, never_returns: bool = False) -> None:
        """Read the FMU at `path`.

        Args:
            path: of the archive.
            never_returns: whether no instance will be returned to an earlier state, so that
                solvers may keep their memory from one step to the next.

        Raises:
            ComponentTypeError: it cannot be run here; the message says why.
        """
        self._never_returns = never_returns
        self._fmu = read_description(Path(path))
        check_binary(self._fmu)
        self._by_kind = {self._fmu.kind: self._fmu}
        self._sizes = Sizes(self._fmu, {})

    @property
    @override
    def description(self) -> str:
        missing = left_out(self._fmu)
        note = f" (without {', '.join(missing)}: not supported as signals)" if missing else ""
        unset = not_set(self._fmu)
        note += f" (without {', '.join(unset)}: not supported as parameters)" if unset else ""
        return self._fmu.description + note + _kind_note(self._fmu)

    @property
    @override
    def parameters(self) -> Mapping[str, Parameter]:
        chosen = self._sizes.chosen
        return MappingProxyType(
            parameters(self._fmu, chosen)
            | start_parameters(self._fmu, chosen)
            | option_parameters(self._fmu)
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of its inputs."""
        return tuple(variable.name for variable in self._fmu.of("input"))

    @property
    def numbers(self) -> tuple[str, ...]:
        """The names of its inputs that are single numbers or truths, which a table may drive."""
        plain = (v for v in self._fmu.of("input") if not (v.axes or v.items or v.is_bytes))
        return tuple(variable.name for variable in plain)

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of its outputs."""
        return tuple(variable.name for variable in self._fmu.of("output"))

    @property
    def settled_axes(self) -> frozenset[str]:
        """Axes of its connectors whose lengths keep what a scenario chooses."""
        axes = {axis for v in self._fmu.variables.values() for axis in v.axes}
        return frozenset(a.name for a in axes if a.name and a.structural in self._sizes.chosen)

    @property
    def inner(self) -> tuple[str, ...]:
        """The names of variables inside that `fmi.locals` can make outputs."""
        return tuple(recordable(self._fmu))

    @override
    def once_per_process(self, values: Mapping[str, Any]) -> str | None:
        fmu = self._described(Said.of(self._fmu, values).options)
        return f"the FMU `{fmu.name}` {fmu.token}" if fmu.is_once_per_process else None

    @override
    def step_problem(
        self, step: StepSize, values: Mapping[str, Any] = MappingProxyType({})
    ) -> str | None:
        fmu = self._described(Said.of(self._fmu, values).options)
        return step_problem(fmu.internal_step, step)

    @override
    def manner(self, values: Mapping[str, Any]) -> str:
        options = Said.of(self._fmu, values).options
        described = self._described(options)
        return integration_text(described, options) if described.kind is Kind.MODEL_EXCHANGE else ""

    @override
    def input_files(self, values: Mapping[str, Any]) -> tuple[Path, ...]:
        return self._fmu.path, *super().input_files(values)

    @override
    def create(self, name: str, values: Mapping[str, Any]) -> Component:
        offered = self.parameters
        if unknown := sorted(set(values) - set(offered)):
            raise ComponentTypeError(f"{self._fmu.path}: there is no parameter `{unknown[0]}`")
        said = Said.of(self._fmu, values)
        options = said.options
        described = self._described(options)
        check_options(described.kind, options)
        fmu = with_options(described, options)
        native = settings(fmu, said.parameters)
        starts = start_settings(fmu, said.parameters, said.starts)
        fmu = started(fmu, starts)
        native |= {n: v for n, v in starts.items() if fmu.variables[n].causality != "input"}
        log = MessageLog(name, is_asked=options.logging)
        for missing in left_out(fmu):
            log.note(f"{missing} of {fmu.path.name} cannot be connected")
        if fmu.kind is Kind.MODEL_EXCHANGE and self._never_returns:
            fmu = replace(fmu, can_restore=False)
        may_restore = fmu.can_restore
        load = functools.partial(_load, fmu, name, log, may_restore=may_restore, options=options)
        if fmu.kind is Kind.MODEL_EXCHANGE:
            return integrated(fmu, native, load, log, options)
        component = FmuComponent(
            fmu, native, load, stepper=_stepper(fmu, log, options), tolerance=options.tolerance
        )
        return RestorableFmuComponent(component) if may_restore else component

    def _described(self, options: Options) -> FmuDescription:
        """The FMU by the interface that is chosen."""
        kind = self._fmu.kind if options.kind is None else Kind(options.kind)
        if kind not in self._by_kind:
            found = read_description(self._fmu.path, kind)
            check_binary(found)
            self._by_kind[kind] = found
        return self._by_kind[kind]


def _kind_note(fmu: FmuDescription) -> str:
    if Kind.MODEL_EXCHANGE not in fmu.kinds:
        return ""
    others = "".join(f", also {kind.words}" for kind in fmu.kinds[1:])
    return f" ({fmu.kind.words}{others})"


def _stepper(fmu: FmuDescription, log: MessageLog, options: Options) -> Stepper:
    return Stepper(
        log,
        asking="`fmi2Terminated`" if fmu.version == 2 else "`terminateSimulation`",
        may_vary=fmu.has_variable_steps,
        smallest=options.smallest_step,
        hint=RETRY_HINT if may_retry(fmu) else "",
    )


def _load(
    fmu: FmuDescription, name: str, log: MessageLog, *, may_restore: bool, options: Options
) -> LoadedInstance:
    if fmu.version == 2:
        return Fmi2Instance(fmu, name, log, may_restore=may_restore)
    uses_events = fmu.is_scheduled or (
        fmu.has_event_mode and (options.event_mode or fmu.has_clocks)
    )
    return Fmi3Instance(fmu, name, log, may_restore=may_restore, uses_events=uses_events)
