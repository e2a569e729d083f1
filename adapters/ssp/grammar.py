"""What may stand in the files of SSP, and what a scenario has no use for.

Names carry the prefixes that the standard uses for its namespaces. The table is that of the XML
schemas of SSP 2.0, which is a superset of that of 1.0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

_HOME: Final = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES: Final = {
    f"{_HOME}Common": "ssc",
    f"{_HOME}Description": "ssd",
    f"{_HOME}ParameterValues": "ssv",
    f"{_HOME}ParameterMapping": "ssm",
    f"{_HOME}SignalDictionary": "ssb",
}
"""Prefixes by namespace; SSP 2.0 has the namespaces of 1.0."""

NOTES: Final = "io.github.nlosim"
"""The type of the annotations that nlosim writes and reads."""

OPENMODELICA: Final = "org.openmodelica"
"""The type of the annotations of OMSimulator, of which the step size is read."""

REALS: Final = ("Real", "Float64", "Float32")
WHOLES: Final = (
    "Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64",
)  # fmt: skip
_BASE: Final = ("id", "description")
_META: Final = (
    "author", "fileversion", "copyright", "license", "generationTool", "generationDateAndTime",
)  # fmt: skip
_KEPT: Final = ("ssc:MetaData", "ssc:Signature")
_SOURCE: Final = ("type", "source", "sourceBase")
_WAYS: Final = tuple(
    f"ssc:{kind}Transformation"
    for kind in ("Linear", "BooleanMapping", "IntegerMapping", "EnumerationMapping")
)
_TYPES: Final = tuple(
    f"ssc:{name}"
    for name in (*REALS, *WHOLES, "Boolean", "String", "Enumeration", "Binary", "Clock")
)
_TOP: Final = (*_BASE, *_META)
_ELEMENT: Final = ("ssd:Connectors", "ssd:ElementGeometry", "ssd:ParameterBindings", *_KEPT)


@dataclass(frozen=True, slots=True)
class Rule:
    """What one element may have.

    Attributes:
        required, optional: attributes.
        children: elements within; `None`: whatever there is, which is not read.
    """

    required: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    children: tuple[str, ...] | None = ()


_VALUES: Final = {
    **{f"ssv:{name}": Rule(("value",), ("unit",)) for name in REALS},
    **{f"ssv:{name}": Rule(("value",)) for name in (*WHOLES, "Boolean")},
    "ssv:String": Rule((), ("value",), ("ssv:Value",)),
    "ssv:Enumeration": Rule((), ("value", "name"), ("ssv:Value",)),
    "ssv:Binary": Rule((), ("value", "mime-type"), ("ssv:Value",)),
}
_CLOCK: Final = (
    "intervalVariability", "intervalDecimal", "shiftDecimal", "supportsFraction", "resolution",
    "intervalCounter", "shiftCounter", "priority",
)  # fmt: skip
_ICON: Final = ("rotation", "iconSource", "iconRotation", "iconFlip", "iconFixedAspectRatio")
_CORNERS: Final = ("x1", "y1", "x2", "y2")

RULES: Final[Mapping[str, Rule]] = {
    "ssd:SystemStructureDescription": Rule(
        ("version", "name"),
        _TOP,
        ("ssd:System", "ssd:Enumerations", "ssd:Units", "ssd:DefaultExperiment", *_KEPT,
         "ssd:Annotations"),
    ),
    "ssd:System": Rule(
        ("name",),
        _BASE,
        (*_ELEMENT, "ssd:Elements", "ssd:Connections", "ssd:SignalDictionaries",
         "ssd:SystemGeometry", "ssd:GraphicalElements", "ssd:Annotations"),
    ),
    "ssd:Component": Rule(
        ("name",), (*_BASE, "type", "source", "implementation"), (*_ELEMENT, "ssd:Annotations")
    ),
    "ssd:SignalDictionaryReference": Rule(
        ("name", "dictionary"), _BASE, (*_ELEMENT, "ssd:Annotations")
    ),
    "ssd:Elements": Rule((), (), ("ssd:Component", "ssd:SignalDictionaryReference", "ssd:System")),
    "ssd:Connectors": Rule((), (), ("ssd:Connector",)),
    "ssd:Connector": Rule(
        ("name", "kind"),
        _BASE,
        (*_TYPES, "ssc:Dimension", "ssd:Clock", "ssd:ConnectorGeometry",
         "ssd:Annotations"),
    ),
    "ssd:Clock": Rule(("name",)),
    "ssd:Connections": Rule((), (), ("ssd:Connection",)),
    "ssd:Connection": Rule(
        ("startConnector", "endConnector"),
        (*_BASE, "startElement", "endElement", "startIndices", "endIndices",
         "suppressUnitConversion"),
        (*_WAYS, "ssd:ConnectionGeometry", "ssd:Annotations"),
    ),
    "ssd:ParameterBindings": Rule((), (), ("ssd:ParameterBinding",)),
    "ssd:ParameterBinding": Rule(
        (),
        (*_BASE, *_SOURCE, "prefix"),
        ("ssd:ParameterValues", "ssd:ParameterMapping", *_KEPT, "ssd:Annotations"),
    ),
    "ssd:ParameterValues": Rule((), (), ("ssv:ParameterSet",)),
    "ssd:ParameterMapping": Rule((), (*_BASE, *_SOURCE), ("ssm:ParameterMapping",)),
    "ssd:SignalDictionaries": Rule((), (), ("ssd:SignalDictionary",)),
    "ssd:SignalDictionary": Rule(("name",), (*_BASE, "type", "source"), ("ssb:SignalDictionary",)),
    "ssd:DefaultExperiment": Rule((), ("startTime", "stopTime"), ("ssd:Annotations",)),
    "ssd:GraphicalElements": Rule((), (), ("ssd:Note",)),
    "ssd:Note": Rule((*_CORNERS, "text"), (), ("ssd:Annotations",)),
    "ssd:SystemGeometry": Rule(_CORNERS),
    "ssd:ElementGeometry": Rule(_CORNERS, _ICON),
    "ssd:ConnectorGeometry": Rule(("x", "y"), ("systemInnerX", "systemInnerY")),
    "ssd:ConnectionGeometry": Rule(("pointsX", "pointsY")),
    "ssc:LinearTransformation": Rule((), ("factor", "offset")),
    **{way: Rule((), (), ("ssc:MapEntry",)) for way in _WAYS[1:]},
    "ssc:MapEntry": Rule(("source", "target")),
    "ssc:Enumeration": Rule((), (*_BASE, "name"), ("ssc:Item", "ssc:Annotations")),
    "ssc:Item": Rule(("name", "value")),
    "ssc:Unit": Rule(("name",), _BASE, ("ssc:BaseUnit", "ssc:Annotations")),
    "ssc:BaseUnit": Rule(
        (), ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset")
    ),
    "ssc:Dimension": Rule((), ("size", "sizeConnector")),
    "ssc:Clock": Rule((), _CLOCK),
    **{f"ssc:{name}": Rule((), ("unit",)) for name in REALS},
    **{f"ssc:{name}": Rule() for name in (*WHOLES, "Boolean", "String")},
    "ssc:Binary": Rule((), ("mime-type",)),
    "ssc:Annotation": Rule(("type",), (), None),
    "ssc:MetaData": Rule((), (*_BASE, "kind", *_SOURCE), None),
    "ssc:Signature": Rule((), (*_BASE, "role", *_SOURCE), None),
    "ssv:ParameterSet": Rule(
        ("version", "name"),
        _TOP,
        ("ssv:Parameters", "ssv:Enumerations", "ssv:Units", *_KEPT, "ssv:Annotations"),
    ),
    "ssv:Parameters": Rule((), (), ("ssv:Parameter",)),
    "ssv:Parameter": Rule(
        ("name",), _BASE, (*_VALUES, "ssc:Dimension", "ssv:Annotations")
    ),
    "ssv:Value": Rule(("value",)),
    **_VALUES,
    "ssm:ParameterMapping": Rule(
        ("version",), _TOP, ("ssm:MappingEntry", *_KEPT, "ssm:Annotations")
    ),
    "ssm:MappingEntry": Rule(
        ("source", "target"), (*_BASE, "suppressUnitConversion"), (*_WAYS, "ssm:Annotations")
    ),
    "ssb:SignalDictionary": Rule(
        ("version",),
        _TOP,
        ("ssb:DictionaryEntry", "ssb:Enumerations", "ssb:Units", *_KEPT, "ssb:Annotations"),
    ),
    "ssb:DictionaryEntry": Rule(
        ("name",), _BASE, (*_TYPES, "ssc:Dimension", "ssb:Annotations")
    ),
    **{f"{file}:Annotations": Rule((), (), ("ssc:Annotation",))
       for file in ("ssc", "ssd", "ssv", "ssm", "ssb")},
    **{f"{file}:Enumerations": Rule((), (), ("ssc:Enumeration",))
       for file in ("ssd", "ssv", "ssb")},
    **{f"{file}:Units": Rule((), (), ("ssc:Unit",)) for file in ("ssd", "ssv", "ssb")},
}  # fmt: skip
"""The rules by element. `ssc:Enumeration` is the definition, and the type of a connector."""

UNUSED: Final[Mapping[str, str]] = {
    "ssd:SystemGeometry": "graphics",
    "ssd:ElementGeometry": "graphics",
    "ssd:ConnectorGeometry": "graphics",
    "ssd:ConnectionGeometry": "graphics",
    "ssd:GraphicalElements": "graphics",
    "ssd:Enumerations": "enumerations; those of the FMUs count",
    "ssc:MetaData": "metadata",
    "ssc:Signature": "signatures",
}
"""Elements that a scenario has no place for, and what people call them."""
