"""What modelDescription.xml says, as far as an importer needs it; FMI 2.0 and 3.0 alike."""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import fmpy.model_description

from adapters.fmi.archive import UNREADABLE, opened
from adapters.fmi.kind import Kind, kinds_of
from adapters.fmi.reading import variables
from adapters.fmi.step_size import internal_step
from adapters.fmi.variable import FmuVariable
from orchestrator.errors import ComponentTypeError

HIGHEST_DEGREE: Final = 2
"""The highest degree of the polynomials that inputs follow; FMI 2.0 lets FMUs say none."""
_EARLY: Final = ("mightReturnEarlyFromDoStep", "canReturnEarlyAfterIntermediateUpdate")


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuDescription:
    """The FMU as a component, by one of its interfaces.

    Attributes:
        path: of the archive.
        version: 2 or 3.
        kind: the interface that is used; `identifier` and the flags below are of this one.
        kinds: all that it has of those that can be used.
        name, description: of the model.
        identifier: file name of the binary without suffix.
        token: instantiation token (FMI 2.0: guid).
        variables: by name, in the order of the file.
        lost: names of inputs and outputs that cannot be used: clocks and clocked ones without event
            mode, which the standard does not allow.
        unknowns: names of the outputs, as the model structure lists them.
        can_restore: it can return to an earlier state.
        can_serialize: it can turn such a state into bytes and back.
        has_directional, has_adjoint: it knows these derivatives of its outputs.
        has_variable_steps: its steps may differ in length.
        may_return_early: FMI 3.0: a step can be left before its end.
        has_event_mode: FMI 3.0: the importer may handle its events.
        intermediate: FMI 3.0: names of the variables that are shown within a step.
        is_once_per_process: two instances of it cannot be in one process.
        internal_step: FMI 3.0: the fixed step of its solver [s], exactly as in the file, positive;
            `None` if it does not say one.
        input_degree: the highest order of derivatives of inputs that it is told; 0: it takes none.
        slopes: the outputs whose derivative with respect to time it tells.
        log_categories: what the FMU can log.
    """

    path: Path
    version: int
    kind: Kind
    kinds: tuple[Kind, ...]
    name: str
    description: str
    identifier: str
    token: str
    variables: Mapping[str, FmuVariable]
    lost: tuple[str, ...]
    unknowns: frozenset[str]
    can_restore: bool
    can_serialize: bool
    has_directional: bool
    has_adjoint: bool
    has_variable_steps: bool
    may_return_early: bool
    has_event_mode: bool
    intermediate: tuple[str, ...]
    is_once_per_process: bool
    internal_step: Fraction | None
    input_degree: int
    slopes: tuple[str, ...]
    log_categories: tuple[str, ...]

    @property
    def can_vary_steps(self) -> bool:
        """Whether steps may be of any length."""
        return self.has_variable_steps and self.internal_step is None

    @property
    def is_scheduled(self) -> bool:
        """FMI 3.0: whether its clocks activate it (Scheduled Execution)."""
        return self.kind is Kind.SCHEDULED_EXECUTION

    @property
    def has_clocks(self) -> bool:
        """Whether it has clocks, which tick in event mode."""
        return any(v.clock is not None for v in self.variables.values())

    def of(self, *causalities: str) -> tuple[FmuVariable, ...]:
        """The variables of these causalities."""
        return tuple(v for v in self.variables.values() if v.causality in causalities)


def read_description(path: Path, kind: Kind | None = None) -> FmuDescription:
    """Read the FMU at `path` without unpacking it.

    Args:
        path: of the archive.
        kind: the interface to be used; without, Co-Simulation if the FMU has it.

    Raises:
        ComponentTypeError: it is no FMI 2.0 or 3.0 FMU, or has no such interface; the message
            says why.
    """
    xml = _read_xml(path)
    root = _parse(path, xml)
    version = root.get("fmiVersion", "")
    if not (version == "2.0" or version.startswith("3.")):
        raise ComponentTypeError(f"{path}: FMI {version or '?'} is not supported, 2.0 and 3.0 are")
    try:
        parsed: Any = fmpy.model_description.read_model_description(_archive_of(xml))
    except Exception as error:
        # what Python says of an index or a name that is missing tells nobody anything
        is_python = isinstance(error, LookupError | AttributeError | TypeError)
        why = "" if is_python else f": {'; '.join(str(error).splitlines())}"
        what = f"modelDescription.xml is invalid{why}"
        hint = "; `nlosim fmu validate` says which rules are broken"
        raise ComponentTypeError(f"{path}: {what}{hint}") from error
    kinds = kinds_of(root)
    if not kinds or kind not in {None, *kinds}:
        offers = " and ".join(each.words for each in kinds) or "no interface"
        wanted = Kind.CO_SIMULATION.words if kind is None else kind.words
        raise ComponentTypeError(
            f"{path}: offers {offers} only; export it for {wanted} to run it here"
        )
    used = kinds[0] if kind is None else kind
    element = root.find(used.element)
    flags = {} if element is None else element.attrib
    every = variables(parsed, root)
    is_lost = {
        n: (v.clock is not None or v.is_clocked)
        and not (_flag(flags, "hasEventMode") or used is Kind.SCHEDULED_EXECUTION)
        for n, v in every.items()
    }
    found = {n: v for n, v in every.items() if not is_lost[n]}
    return FmuDescription(
        path=path,
        version=int(version[0]),
        kind=used,
        kinds=kinds,
        name=parsed.modelName,
        description=parsed.description or parsed.modelName,
        identifier=flags.get("modelIdentifier", ""),
        token=parsed.guid,
        variables=found,
        lost=tuple(
            n for n, v in every.items() if is_lost[n] and v.causality in {"input", "output"}
        ),
        unknowns=frozenset(each.variable.name for each in parsed.outputs),
        can_restore=_flag(flags, "canGetAndSetFMUState", "canGetAndSetFMUstate"),
        can_serialize=_flag(flags, "canSerializeFMUState", "canSerializeFMUstate"),
        has_directional=_flag(
            flags, "providesDirectionalDerivatives", "providesDirectionalDerivative"
        ),
        has_adjoint=_flag(flags, "providesAdjointDerivatives"),
        has_variable_steps=_flag(flags, "canHandleVariableCommunicationStepSize"),
        has_event_mode=_flag(flags, "hasEventMode"),
        may_return_early=_flag(flags, *_EARLY),
        intermediate=_intermediate(root) if _flag(flags, "providesIntermediateUpdate") else (),
        is_once_per_process=_flag(flags, "canBeInstantiatedOnlyOncePerProcess"),
        internal_step=internal_step(flags.get("fixedInternalStepSize")),
        input_degree=HIGHEST_DEGREE if _flag(flags, "canInterpolateInputs") else 0,
        slopes=_slopes(found, flags),
        log_categories=tuple(category.name for category in parsed.logCategories),
    )


def read_root(path: Path) -> ET.Element:
    """The root of modelDescription.xml of the FMU at `path`.

    Raises:
        ComponentTypeError: it is no FMU.
    """
    return _parse(path, _read_xml(path))


def _archive_of(xml: bytes) -> io.BytesIO:
    """An archive with nothing but the description: FMPy leaves real files open on errors."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
    return buffer


def _read_xml(path: Path) -> bytes:
    try:
        with opened(path) as archive:
            return archive.read("modelDescription.xml")
    except KeyError as error:
        raise ComponentTypeError(f"{path}: holds no modelDescription.xml, so is no FMU") from error
    except UNREADABLE as error:
        raise ComponentTypeError(f"{path}: cannot be read: {error}") from error


def _parse(path: Path, xml: bytes) -> ET.Element:
    try:
        return ET.fromstring(xml)  # noqa: S314  (whoever loads an FMU runs its code)
    except (ET.ParseError, LookupError, ValueError) as error:  # two of them: of its encoding
        raise ComponentTypeError(f"{path}: modelDescription.xml is no XML: {error}") from error


def _slopes(found: Mapping[str, FmuVariable], flags: Mapping[str, str]) -> tuple[str, ...]:
    has_some = flags.get("maxOutputDerivativeOrder", "0").strip() not in {"", "0"}
    return tuple(v.name for v in found.values() if has_some and v.has_rate)


def _intermediate(root: ET.Element) -> tuple[str, ...]:
    return tuple(
        element.get("name", "")
        for element in root.iterfind("ModelVariables/*")
        if _flag(element.attrib, "intermediateUpdate")
    )


def _flag(attributes: Mapping[str, str], *names: str) -> bool:
    """Whether one of these is true; FMI 2.0 and 3.0 spell them differently."""
    return any(attributes.get(name) in {"true", "1"} for name in names)
