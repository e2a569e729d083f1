"""What a scenario may say about how an FMU is integrated: `fmi.kind`, `fmi.solver`, `fmi.step`."""

from collections.abc import Iterator, Mapping
from typing import Any, Final, Literal

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


_OWN: Final = ("solver", "step")
_OTHERS: Final = (
    "smallest_step",
    "event_mode",
    "intermediate",
    "input_degree",
    "output_slopes",
)


def problems(kind: Kind, said: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What is wrong with what is said, by option.

    Args:
        kind: the interface that is used.
        said: values by option; without those of which nothing is said.
    """
    is_own = kind is Kind.MODEL_EXCHANGE
    others = _OTHERS if is_own else _OWN
    other = Kind.CO_SIMULATION if is_own else Kind.MODEL_EXCHANGE
    for name in others:
        if name in said:
            yield name, f"concerns {other.words} only; write `fmi.kind: {other.value}`, too"
    if is_own:
        for name in ("step", "tolerance"):
            if said.get(name) == 0.0:
                yield name, "must be greater than 0"
