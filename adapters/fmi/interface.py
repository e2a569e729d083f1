"""What an FMU can do behind one of its interfaces: Co-Simulation, Model Exchange, ..."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any
from xml.etree import ElementTree as ET

from orchestrator.errors import ComponentTypeError


class Kind(enum.Enum):
    """The interfaces of FMI; values are what a scenario says."""

    CO_SIMULATION = "cs"
    MODEL_EXCHANGE = "me"
    SCHEDULED_EXECUTION = "se"

    @property
    def element(self) -> str:
        """Its element in modelDescription.xml."""
        return {"cs": "CoSimulation", "me": "ModelExchange", "se": "ScheduledExecution"}[self.value]


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface:
    """One interface of an FMU.

    Attributes:
        kind: which.
        identifier: file name of the binary without suffix.
        can_restore: it can return to an earlier state.
        can_serialise: a state can become bytes.
        has_directional, has_adjoint: it knows its partial derivatives.
        can_vary_step: the communication step size may change during the run.
        fixed_step: the internal step size [s], exactly as written.
        is_once: a process may hold one instance only.
        has_event_mode: events can be handled by the importer.
        may_return_early: a step may end before its time after an intermediate update.
        completes_steps: Model Exchange: it wants to hear of each completed integrator step.
    """

    kind: Kind
    identifier: str
    can_restore: bool
    can_serialise: bool
    has_directional: bool
    has_adjoint: bool
    can_vary_step: bool
    fixed_step: Fraction | None
    is_once: bool
    has_event_mode: bool
    may_return_early: bool
    completes_steps: bool


def interfaces(root: ET.Element) -> dict[Kind, Interface]:
    """The interfaces that modelDescription.xml declares, the one used by default first.

    Raises:
        ComponentTypeError: `fixedInternalStepSize` is no positive number.
    """
    elements = {kind: root.find(kind.element) for kind in Kind}
    return {k: _interface(k, e.attrib) for k, e in elements.items() if e is not None}


def _interface(kind: Kind, said: Mapping[str, Any]) -> Interface:
    def flag(*names: str) -> bool:
        return any(said.get(name) in {"true", "1"} for name in names)

    return Interface(
        kind=kind,
        identifier=said.get("modelIdentifier", ""),
        can_restore=flag("canGetAndSetFMUState", "canGetAndSetFMUstate"),
        can_serialise=flag("canSerializeFMUState", "canSerializeFMUstate"),
        has_directional=flag("providesDirectionalDerivatives", "providesDirectionalDerivative"),
        has_adjoint=flag("providesAdjointDerivatives"),
        can_vary_step=flag("canHandleVariableCommunicationStepSize"),
        fixed_step=_fixed_step(said.get("fixedInternalStepSize")),
        is_once=flag("canBeInstantiatedOnlyOncePerProcess"),
        has_event_mode=flag("hasEventMode"),
        may_return_early=flag(
            "mightReturnEarlyFromDoStep", "canReturnEarlyAfterIntermediateUpdate"
        ),
        completes_steps=flag("needsCompletedIntegratorStep")
        or (
            "completedIntegratorStepNotNeeded" in said
            and not flag("completedIntegratorStepNotNeeded")
        ),
    )


def _fixed_step(text: str | None) -> Fraction | None:
    if text is None:
        return None
    try:
        step = Fraction(text.strip())
    except (ValueError, ZeroDivisionError):
        step = Fraction(0)
    if step <= 0:
        raise ComponentTypeError(f"`fixedInternalStepSize` must be a positive number, is {text!r}")
    return step
