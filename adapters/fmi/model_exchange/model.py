"""What modelDescription.xml says of the differential equation in an FMU."""

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from adapters.fmi.kind import Kind
from adapters.fmi.variable import FmuVariable

_STANDARD_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class ContinuousModel:
    """The equation of an FMU.

    Attributes:
        states: its continuous states, in the order of FMI's vectors.
        rates: their derivatives, in the same order.
        indicators: number of event indicators; in FMI 3.0 the instance knows better.
        needs_completed_steps: whether it has to hear of every completed step of the solver.
        has_directional: whether it knows directional derivatives.
        tolerance: relative, of its default experiment, or 1e-6.
        step: of its default experiment [s]; `None` if it says none.
    """

    states: tuple[FmuVariable, ...]
    rates: tuple[FmuVariable, ...]
    indicators: int
    needs_completed_steps: bool
    has_directional: bool
    tolerance: float
    step: float | None


def continuous_model(root: ET.Element, variables: Mapping[str, FmuVariable]) -> ContinuousModel:
    """The equation of an FMU with the interface Model Exchange.

    Args:
        root: of modelDescription.xml.
        variables: of the FMU by name, in the order of the file.
    """
    element = root.find(Kind.MODEL_EXCHANGE.element)
    flags = {} if element is None else element.attrib
    experiment = root.find("DefaultExperiment")
    said = {} if experiment is None else experiment.attrib
    is_second = root.get("fmiVersion", "").startswith("2.")
    find_rates = _rates2 if is_second else _rates3
    rates = find_rates(root, variables)
    return ContinuousModel(
        states=tuple(variables[each.derivative_of] for each in rates if each.derivative_of),
        rates=rates,
        indicators=int(root.get("numberOfEventIndicators") or 0) if is_second else 0,
        needs_completed_steps=_is(flags, "needsCompletedIntegratorStep", default=True)
        and not _is(flags, "completedIntegratorStepNotNeeded", default=False),
        has_directional=_is(flags, "providesDirectionalDerivative", default=False)
        or _is(flags, "providesDirectionalDerivatives", default=False),
        tolerance=_positive(said.get("tolerance")) or _STANDARD_TOLERANCE,
        step=_positive(said.get("stepSize")),
    )


def _rates2(root: ET.Element, variables: Mapping[str, FmuVariable]) -> tuple[FmuVariable, ...]:
    numbered = tuple(variables.values())
    found = root.iterfind("ModelStructure/Derivatives/Unknown")
    return tuple(numbered[int(each.get("index", "1")) - 1] for each in found)


def _rates3(root: ET.Element, variables: Mapping[str, FmuVariable]) -> tuple[FmuVariable, ...]:
    by_reference = {str(each.reference): each for each in variables.values()}
    found = root.iterfind("ModelStructure/ContinuousStateDerivative")
    return tuple(by_reference[each.get("valueReference", "")] for each in found)


def _is(flags: Mapping[str, str], name: str, *, default: bool) -> bool:
    return flags[name] in {"true", "1"} if name in flags else default


def _positive(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if value > 0 else None
