"""Components of FMUs for Model Exchange."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from adapters.fmi.component import FmuComponent
from adapters.fmi.description import FmuDescription, read_root
from adapters.fmi.kind import Kind
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.model_exchange import solvers
from adapters.fmi.model_exchange.component import (
    Instances,
    ModelExchangeComponent,
    RestorableModelExchangeComponent,
)
from adapters.fmi.model_exchange.cvode import library
from adapters.fmi.model_exchange.instance import ModelExchangeInstance
from adapters.fmi.model_exchange.model import ContinuousModel, continuous_model
from adapters.fmi.options import Options
from adapters.fmi.stepping import Stepper
from orchestrator.component import Component


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """How an FMU is integrated.

    Attributes:
        solver: its name.
        tolerance: relative.
        step: the longest one of the solver [s]; `None`: as far as it is let.
    """

    solver: str
    tolerance: float
    step: float | None

    @classmethod
    def of(cls, model: ContinuousModel, options: Options) -> "_Plan":
        solver = options.solver or solvers.CVODE
        step = options.step
        if step is None and not solvers.is_controlled(solver):
            step = model.step
        return cls(solver=solver, tolerance=options.tolerance or model.tolerance, step=step)


def _model(description: FmuDescription) -> ContinuousModel:
    return continuous_model(read_root(description.path), description.variables)


def integration_text(description: FmuDescription, options: Options) -> str:
    """How an FMU is integrated, in words.

    Args:
        description: of its interface Model Exchange.
        options: how it is run.
    """
    plan = _Plan.of(_model(description), options)
    if solvers.is_controlled(plan.solver):
        said = f", relative tolerance {plan.tolerance:g}"
        said += "" if plan.step is None else f", steps of {plan.step:g} s at most"
    else:
        step = "one step" if plan.step is None else f"steps of {plan.step:g} s at most"
        said = f", {step} between communication points"
    return f"{Kind.MODEL_EXCHANGE.words} by {plan.solver}{said}"


def integrated(
    description: FmuDescription,
    values: Mapping[str, Any],
    load: Callable[[], LoadedInstance],
    log: MessageLog,
    options: Options,
) -> Component:
    """An FMU that is integrated here.

    Args:
        description: of its interface Model Exchange.
        values: of parameters, and start values of what is neither parameter nor input.
        load: makes an instance.
        log: of the FMU.
        options: how it is run.

    Raises:
        ComponentTypeError: this machine does not have the solver.
    """
    model = _model(description)
    plan = _Plan.of(model, options)
    if plan.solver == solvers.CVODE:
        library()
    make_solver = functools.partial(
        solvers.made, plan.solver, tolerance=plan.tolerance, step=plan.step
    )
    instances = Instances(
        lambda: ModelExchangeInstance(
            load(), description, model, make_solver, may_restore=description.can_restore
        )
    )
    fmu = FmuComponent(
        replace(description, can_serialize=False),  # a solver goes with the state
        values,
        instances,
        stepper=Stepper(log, asking="`terminateSimulation`", may_vary=True),
        tolerance=plan.tolerance,
    )
    has_slopes = any(state.causality == "output" for state in model.states)
    may_restore = description.can_restore
    component = ModelExchangeComponent(
        fmu, instances, has_slopes=has_slopes, may_restore=may_restore
    )
    if not may_restore:
        return component
    return RestorableModelExchangeComponent(component, fmu)
