"""The modelDescription.xml of a native unit, from its `Interface` (FMI 3.0.2, section 2.4)."""

from typing import Final
from xml.etree import ElementTree as ET

from fmus.native.check import FLOATS, NOT_NUMERIC, type_name
from fmus.native.interface import Interface, Variable
from fmus.native.units import UNITS

LOG_CATEGORIES: Final = {
    "logEvents": "Progress of the model",
    "logStatusWarning": "Reasons of the status Warning",
    "logStatusDiscard": "Reasons of the status Discard",
    "logStatusError": "Reasons of the status Error; always logged",
    "logStatusFatal": "Reasons of the status Fatal; always logged",
}
"""What each category of log messages has, in the order of ModelStatus (fmi3_model.h) and of
CATEGORIES (fmi3_log.c)."""


def model_description(interface: Interface, *, token: str, version: str) -> bytes:
    """The bytes of modelDescription.xml: UTF-8, line ends of Unix.

    Args:
        interface: a checked interface.
        token: the instantiationToken.
        version: the version of the model.
    """
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=interface.name,
        instantiationToken=token,
        description=interface.description,
        version=version,
        license="Apache-2.0",
        generationTool="nlosim fmus.native.build",
        variableNamingConvention="structured",
    )
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=interface.name,
        canHandleVariableCommunicationStepSize="true",
        canBeInstantiatedOnlyOncePerProcess="false",
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        hasEventMode="true",
    )
    _add_units(root, interface)
    _add_types(root, interface)
    categories = ET.SubElement(root, "LogCategories")
    for name, description in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=description)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize="0.1")
    references = {variable.name: k for k, variable in enumerate(interface.variables, start=1)}
    variables = ET.SubElement(root, "ModelVariables")
    _add_time(variables)
    for variable in interface.variables:
        _add_variable(variables, variable, references)
    _add_structure(root, interface, references)
    ET.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root) + b"\n"


def literal(variable: Variable, number: float) -> str:
    """How a modelDescription.xml writes `number` for the type of `variable`."""
    if variable.type == "Boolean":
        return "true" if number else "false"
    return repr(float(number)) if variable.type in FLOATS else str(int(number))


def _add_units(root: ET.Element, interface: Interface) -> None:
    used = {v.unit for v in interface.variables if v.type in FLOATS} | {"s"}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(used):
        unit = UNITS[name]
        element = ET.SubElement(definitions, "Unit", name=name)
        if unit.exponents is None:
            continue
        base = ET.SubElement(element, "BaseUnit", {k: str(n) for k, n in unit.exponents.items()})
        if unit.factor != 1:
            base.set("factor", repr(unit.factor))


def _add_types(root: ET.Element, interface: Interface) -> None:
    enumerations = [v for v in interface.variables if v.type == "Enumeration"]
    if not enumerations:
        return
    definitions = ET.SubElement(root, "TypeDefinitions")
    for variable in enumerations:
        element = ET.SubElement(definitions, "EnumerationType", name=type_name(variable.name))
        for value, item in enumerate(variable.items, start=1):
            ET.SubElement(element, "Item", name=item, value=str(value))


def _add_time(parent: ET.Element) -> None:
    ET.SubElement(
        parent,
        "Float64",
        name="time",
        valueReference="0",
        causality="independent",
        variability="continuous",
        unit="s",
        description="Simulation time",
    )


def _add_variable(parent: ET.Element, variable: Variable, references: dict[str, int]) -> None:
    element = ET.SubElement(
        parent,
        variable.type,
        name=variable.name,
        valueReference=str(references[variable.name]),
        causality=variable.causality,
        variability=variable.variability,
        description=variable.description,
    )
    _annotate(element, variable)
    if variable.type in FLOATS:
        element.set("unit", variable.unit)
    if variable.type == "Enumeration":
        element.set("declaredType", type_name(variable.name))
        element.set("min", "1")
        element.set("max", str(len(variable.items)))
    if variable.type == "Binary":
        element.set("mimeType", variable.mime_type)
    if variable.type not in NOT_NUMERIC:
        for key, bound in (("min", variable.minimum), ("max", variable.maximum)):
            if bound is not None:
                element.set(key, literal(variable, bound))
    for axis in variable.dimensions:
        if isinstance(axis, int):
            ET.SubElement(element, "Dimension", start=str(axis))
        else:
            ET.SubElement(element, "Dimension", valueReference=str(references[axis]))
    if variable.causality == "output":
        element.set("initial", "calculated")
    elif variable.type == "Binary":
        ET.SubElement(element, "Start", value="")
    else:
        element.set("start", literal(variable, variable.start))


def _annotate(element: ET.Element, variable: Variable) -> None:
    """Say what an input means without a connection, and of which value of a parameter to beware.

    The schema wants it before dimensions.
    """
    undriven, caution = variable.undriven, variable.caution
    if undriven is None and caution is None:
        return
    annotations = ET.SubElement(element, "Annotations")
    if caution is not None:
        annotation = ET.SubElement(annotations, "Annotation", type="io.github.nlosim.caution")
        value = str(caution.value)
        said = ET.SubElement(annotation, "Caution", value=value.lower())
        said.text = caution.meaning
    if undriven is None:
        return
    annotation = ET.SubElement(annotations, "Annotation", type="io.github.nlosim.undriven")
    said = ET.SubElement(annotation, "Undriven", need=undriven.need.value)
    if undriven.beside:
        said.set("beside", " ".join(sorted(undriven.beside)))
    said.text = undriven.meaning


def _add_structure(root: ET.Element, interface: Interface, references: dict[str, int]) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [v for v in interface.variables if v.causality == "output"]
    parameters = [v.name for v in interface.variables if v.causality == "parameter"]
    for variable in outputs:
        _add_unknown(structure, "Output", variable, variable.dependencies, references)
    for variable in outputs:  # before the first step outputs may show parameters as well
        names = (*variable.dependencies, *parameters)
        _add_unknown(structure, "InitialUnknown", variable, names, references)


def _add_unknown(
    parent: ET.Element,
    kind: str,
    variable: Variable,
    dependencies: tuple[str, ...],
    references: dict[str, int],
) -> None:
    known = sorted({references[name] for name in dependencies})
    ET.SubElement(
        parent,
        kind,
        valueReference=str(references[variable.name]),
        dependencies=" ".join(map(str, known)),
    )
