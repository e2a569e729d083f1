"""Components of FMUs for Model Exchange."""

import functools
from collections.abc import Callable, Mapping
from typing import Any

from adapters.fmi.component import FmuComponent
from adapters.fmi.description import FmuDescription, read_root
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.model_exchange import solvers
from adapters.fmi.model_exchange.component import (
    Instances,
    ModelExchangeComponent,
    RestorableModelExchangeComponent,
)
from adapters.fmi.model_exchange.cvode import library
from adapters.fmi.model_exchange.instance import ModelExchangeInstance
from adapters.fmi.model_exchange.model import continuous_model
from adapters.fmi.options import Options
from orchestrator.component import Component


def integrated(
    description: FmuDescription,
    values: Mapping[str, Any],
    load: Callable[[], LoadedInstance],
    options: Options,
) -> Component:
    """An FMU that is integrated here.

    Args:
        description: of its interface Model Exchange.
        values: of parameters, and start values of what is neither parameter nor input.
        load: makes an instance.
        options: how it is run.

    Raises:
        ComponentTypeError: this machine does not have the solver.
    """
    model = continuous_model(read_root(description.path), description.variables)
    solver = options.solver or solvers.CVODE
    if solver == solvers.CVODE:
        library()
    tolerance = options.tolerance or model.tolerance
    step = options.step
    if step is None and solver != solvers.CVODE:
        step = model.step
    make_solver = functools.partial(solvers.made, solver, tolerance=tolerance, step=step)
    instances = Instances(
        lambda: ModelExchangeInstance(
            load(), description, model, make_solver, may_restore=description.can_restore
        )
    )
    fmu = FmuComponent(description, values, instances, tolerance=tolerance)
    has_slopes = any(state.causality == "output" for state in model.states)
    may_restore = description.can_restore
    component = ModelExchangeComponent(
        fmu, instances, has_slopes=has_slopes, may_restore=may_restore
    )
    if not may_restore:
        return component
    return RestorableModelExchangeComponent(component, fmu)
