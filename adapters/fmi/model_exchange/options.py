"""What a scenario may say about how an FMU is integrated: `fmi.kind`, `fmi.solver`, `fmi.step`."""

from collections.abc import Iterator
from typing import Final, Literal

from adapters.fmi.description import FmuDescription
from adapters.fmi.kind import Kind
from adapters.fmi.model_exchange.solvers import CVODE, NAMES
from orchestrator.parameters import Parameter

_DOC: Final = "with model-exchange: "


def parameters(description: FmuDescription) -> dict[str, Parameter]:
    """The options of an FMU that has Model Exchange, by name; none for another one."""
    if Kind.MODEL_EXCHANGE not in description.kinds:
        return {}
    return {
        "kind": Parameter(
            type=Literal[tuple(kind.value for kind in description.kinds)],
            default=description.kinds[0].value,
            doc="the interface of the FMU that is used",
            is_optional=True,
        ),
        "solver": Parameter(
            type=Literal[NAMES],
            default=CVODE,
            doc=_DOC + "cvode, for stiff equations, too; dopri5, of variable step; rk4, euler",
            is_optional=True,
        ),
        "step": Parameter(
            type=float | None,
            unit="s",
            default=None,
            minimum=0.0,
            doc=_DOC + "the longest step of the solver, which always stops at communication points",
            is_optional=True,
        ),
    }


def problems(
    kind: Kind, *, solver: str | None, step: float | None, tolerance: float | None
) -> Iterator[tuple[str, str]]:
    """What is wrong with what is said, by option.

    Args:
        kind: the interface that is used.
        solver: what is said of it, `None` if nothing is; likewise the others.
        step: of the solver [s].
        tolerance: relative.
    """
    if kind is Kind.CO_SIMULATION:
        for name, value in (("solver", solver), ("step", step)):
            if value is not None:
                yield name, "concerns Model Exchange only; write `fmi.kind: model-exchange`, too"
        return
    for name, value in (("step", step), ("tolerance", tolerance)):
        if value == 0.0:
            yield name, "must be greater than 0"
