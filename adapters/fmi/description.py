"""What modelDescription.xml says, as far as co-simulation needs it; FMI 2.0 and 3.0 alike."""

import io
import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import fmpy.model_description
import numpy as np
import numpy.typing as npt

from adapters.fmi.archive import opened
from adapters.fmi.step_size import internal_step
from adapters.fmi.unit_definitions import read_definitions
from orchestrator.errors import ComponentTypeError
from orchestrator.units import Unit

DTYPES: Final[Mapping[str, npt.DTypeLike]] = {
    "Float32": np.float32,
    "Float64": np.float64,
    "Int8": np.int8,
    "UInt8": np.uint8,
    "Int16": np.int16,
    "UInt16": np.uint16,
    "Int32": np.int32,
    "UInt32": np.uint32,
    "Int64": np.int64,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
    # FMI 2.0
    "Real": np.float64,
    "Integer": np.int32,
}
"""Element types of the variables that can be signals, besides Binary."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One dimension of an array: a fixed length, or a structural parameter.

    Attributes:
        length: of the axis when nothing is set.
        structural: name of the structural parameter; `None` for a fixed length.
    """

    length: int
    structural: str | None

    @property
    def name(self) -> str | None:
        """What connectors call the axis: the structural parameter without a leading `n_`."""
        return None if self.structural is None else self.structural.removeprefix("n_")


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuVariable:
    """One variable of the FMU.

    Attributes:
        name: as in the file.
        reference: its value reference.
        type: of the functions that access it, e.g. `Float64`, `Real`, `Binary`, `String`.
        causality, variability: as in the file, defaults filled in.
        unit: `"1"` if the file is silent.
        definition: of the unit, if the file has one.
        is_relative: whether it is a difference of quantities (`relativeQuantity`).
        start: the start values in row-major order, one value for all elements, or none.
        minimum, maximum: inclusive bounds.
        items: of an Enumeration, the values within the bounds by their names, in the order of
            the file.
        axes: the dimensions; empty for a scalar.
        dependencies: of an output, the names of the inputs it depends on at the same time;
            `None` stands for all.
        mime_type: contents of a Binary.
        is_clocked: it can only be used while a clock ticks.
        description: one sentence.
    """

    name: str
    reference: int
    type: str
    causality: str
    variability: str
    unit: str
    definition: Unit | None
    is_relative: bool
    start: tuple[Any, ...]
    minimum: float | None
    maximum: float | None
    items: Mapping[str, int]
    axes: tuple[Axis, ...]
    dependencies: frozenset[str] | None
    mime_type: str
    is_clocked: bool
    description: str

    @property
    def is_signal(self) -> bool:
        """Whether a connector can carry it."""
        return (self.type in DTYPES or self.type == "Binary") and not self.is_clocked


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuDescription:
    """The FMU as a co-simulation component.

    Attributes:
        path: of the archive.
        version: 2 or 3.
        name, description: of the model.
        identifier: file name of the binary without suffix.
        token: instantiation token (FMI 2.0: guid).
        variables: by name, in the order of the file.
        can_restore: it can return to an earlier state.
        is_once_per_process: two instances of it cannot be in one process.
        internal_step: FMI 3.0: the fixed step of its solver [s], exactly as in the file, positive;
            `None` if it does not say one.
        log_categories: what the FMU can log.
    """

    path: Path
    version: int
    name: str
    description: str
    identifier: str
    token: str
    variables: Mapping[str, FmuVariable]
    can_restore: bool
    is_once_per_process: bool
    internal_step: Fraction | None
    log_categories: tuple[str, ...]

    def of(self, *causalities: str) -> tuple[FmuVariable, ...]:
        """The variables of these causalities."""
        return tuple(v for v in self.variables.values() if v.causality in causalities)


def read_description(path: Path) -> FmuDescription:
    """Read the FMU at `path` without unpacking it.

    Raises:
        ComponentTypeError: it is no FMI 2.0 or 3.0 co-simulation FMU; the message says why.
    """
    xml = _read_xml(path)
    root = _parse(path, xml)
    version = root.get("fmiVersion", "")
    if not (version == "2.0" or version.startswith("3.")):
        raise ComponentTypeError(f"{path}: FMI {version or '?'} is not supported, 2.0 and 3.0 are")
    try:
        parsed: Any = fmpy.model_description.read_model_description(_archive_of(xml))
    except Exception as error:
        raise ComponentTypeError(f"{path}: modelDescription.xml is invalid: {error}") from error
    kind = parsed.coSimulation
    if kind is None:
        offers = "Model Exchange" if parsed.modelExchange is not None else "Scheduled Execution"
        raise ComponentTypeError(
            f"{path}: offers {offers} only; export it for Co-Simulation to run it here"
        )
    element = root.find("CoSimulation")
    flags = {} if element is None else element.attrib
    return FmuDescription(
        path=path,
        version=int(version[0]),
        name=parsed.modelName,
        description=parsed.description or parsed.modelName,
        identifier=kind.modelIdentifier,
        token=parsed.guid,
        variables=_variables(parsed, root),
        can_restore=_flag(flags, "canGetAndSetFMUState") or _flag(flags, "canGetAndSetFMUstate"),
        is_once_per_process=_flag(flags, "canBeInstantiatedOnlyOncePerProcess"),
        internal_step=internal_step(flags.get("fixedInternalStepSize")),
        log_categories=tuple(category.name for category in parsed.logCategories),
    )


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
    except (zipfile.BadZipFile, OSError, zlib.error) as error:
        raise ComponentTypeError(f"{path}: cannot be read: {error}") from error


def _parse(path: Path, xml: bytes) -> ET.Element:
    try:
        return ET.fromstring(xml)  # noqa: S314  (whoever loads an FMU runs its code)
    except ET.ParseError as error:
        raise ComponentTypeError(f"{path}: modelDescription.xml is no XML: {error}") from error


def _flag(attributes: Mapping[str, str], name: str) -> bool:
    return attributes.get(name) in {"true", "1"}


def _variables(parsed: Any, root: ET.Element) -> dict[str, FmuVariable]:
    enumeration = "Integer" if parsed.fmiVersion == "2.0" else "Int64"
    raw = _raw_attributes(root)
    dependencies = {
        unknown.variable.name: unknown.dependencies
        for unknown in parsed.outputs
        if unknown.dependencies is not None
    }
    definitions = read_definitions(root)
    return {
        variable.name: _variable(
            variable,
            raw.get(variable.name, {}),
            dependencies,
            enumeration=enumeration,
            definitions=definitions,
        )
        for variable in parsed.modelVariables
    }


def _raw_attributes(root: ET.Element) -> dict[str, Mapping[str, str]]:
    """Attributes by variable name: FMPy drops the bounds of unsigned integers and mimeType."""
    found: dict[str, Mapping[str, str]] = {}
    for element in root.iterfind("ModelVariables/*"):
        typed = element[0].attrib if element.tag == "ScalarVariable" and len(element) else {}
        found[element.get("name", "")] = {**typed, **element.attrib}
    return found


def _variable(
    parsed: Any,
    raw: Mapping[str, str],
    dependencies: Mapping[str, list[Any]],
    *,
    enumeration: str,
    definitions: Mapping[str, Unit],
) -> FmuVariable:
    declared = parsed.declaredType
    unit = parsed.unit or (declared.unit if declared is not None else None) or "1"
    low = raw.get("min", declared.min if declared is not None else None)
    high = raw.get("max", declared.max if declared is not None else None)
    minimum = None if low is None else _number(low)
    maximum = None if high is None else _number(high)
    known = dependencies.get(parsed.name)
    return FmuVariable(
        name=parsed.name,
        reference=parsed.valueReference,
        type=enumeration if parsed.type == "Enumeration" else parsed.type,
        causality=parsed.causality,
        variability=parsed.variability,
        unit=unit,
        definition=definitions.get(unit),
        is_relative=_is_relative(raw, declared),
        start=_start(parsed),
        minimum=minimum,
        maximum=maximum,
        items=_items(declared, minimum, maximum) if parsed.type == "Enumeration" else {},
        axes=tuple(map(_axis, parsed.dimensions)),
        dependencies=None if known is None else frozenset(v.name for v in known),
        mime_type=raw.get("mimeType", "application/octet-stream"),
        is_clocked="clocks" in raw,
        description=parsed.description or "",
    )


def _is_relative(raw: Mapping[str, str], declared: Any) -> bool:
    """FMI 2.0.4, 2.2.7, and 3.0.2, 2.4.7.5: what a variable says overrides its type."""
    if "relativeQuantity" in raw:
        return _flag(raw, "relativeQuantity")
    return declared is not None and bool(declared.relativeQuantity)


def _items(declared: Any, minimum: float | None, maximum: float | None) -> dict[str, int]:
    """FMI 3.0.2, 2.4.4: items outside the bounds are not allowed."""
    low = -math.inf if minimum is None else minimum
    high = math.inf if maximum is None else maximum
    values = {item.name: int(item.value) for item in declared.items} if declared else {}
    return {name: value for name, value in values.items() if low <= value <= high}


def _axis(dimension: Any) -> Axis:
    if dimension.variable is None:
        return Axis(length=int(dimension.start), structural=None)
    return Axis(length=int(dimension.variable.start), structural=dimension.variable.name)


def _number(text: str) -> float:
    """Integers stay exact: a float has no room for the largest ones."""
    try:
        return int(text)
    except ValueError:
        value = float(text)
        return int(value) if math.isfinite(value) and value == int(value) else value


def _start(parsed: Any) -> tuple[Any, ...]:
    if parsed.start is None:
        return ()
    if parsed.type == "String":
        return (parsed.start,)
    if parsed.type == "Binary":
        return (bytes.fromhex(parsed.start),)
    words = parsed.start.split()
    if parsed.type == "Boolean":
        return tuple(word in {"true", "1"} for word in words)
    if parsed.type in {"Real", "Float32", "Float64"}:
        return tuple(float(word) for word in words)
    return tuple(int(word) for word in words)
