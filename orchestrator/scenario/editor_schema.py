"""The JSON Schema of scenario files with the parameters of everything that is installed."""

from collections.abc import Callable, Mapping
from typing import Any, Final, cast

from orchestrator import measure, registry, report
from orchestrator.algorithm import base
from orchestrator.errors import ComponentTypeError
from orchestrator.kinds import record_in
from orchestrator.parameters import REQUIRED, Parameter, declared, description
from orchestrator.scenario.parameter_schema import ParameterSchemas, Schema
from orchestrator.scenario.schema import json_schema


def installed_schema() -> Schema:
    """The JSON Schema (draft 2020-12) of scenario files for this installation.

    A component's `type` is one of those that are installed, and its parameters are those of the
    type. The parameters of an FMU given by its path are not known. What cannot be loaded is named
    with the reason, and its parameters are not checked.
    """
    schema = json_schema()
    part, whole = ParameterSchemas(is_whole=False), ParameterSchemas(is_whole=True)
    _add_components(schema, part, whole)
    _add_algorithms(schema["$defs"]["Coupling"], part)
    _add_measures(_mapping(schema["properties"]["measures"]), part)
    _add_reports(schema["$defs"]["ReportEntry"], part)
    schema["$defs"].update(part.definitions | whole.definitions)
    return schema


_IN_A_FILE: Final[Schema] = {
    "type": "string",
    "pattern": ":",
    "description": "A class in a file beside the scenario, `module:Class`.",
}


def _add_components(schema: Schema, part: ParameterSchemas, whole: ParameterSchemas) -> None:
    entry = schema["$defs"]["ComponentEntry"]
    entries_of_whole = schema["then"]["properties"]["components"]["additionalProperties"]
    found, names = {}, []
    for name, offer in registry.installed().items():
        try:
            kind = offer.load()
        except ComponentTypeError as error:
            names.append({"const": name, "description": f"not usable: {error}"})
            continue
        names.append({"const": name, "description": kind.description})
        found[name] = kind.parameters
    entry["properties"]["type"]["anyOf"] = [*names, _IN_A_FILE, {"type": "null"}]
    conditions = [
        _if_is("type", name, {"properties": {"parameters": part.parameters(parameters)}})
        for name, parameters in found.items()
    ]
    _add_all(entry, conditions)
    conditions_of_whole = [
        _if_is("type", name, _asked(parameters, whole))
        for name, parameters in found.items()
        if any(p.default is REQUIRED or record_in(p.type) for p in parameters.values())
    ]
    _add_all(entries_of_whole, conditions_of_whole)


def _asked(parameters: Mapping[str, Parameter], whole: ParameterSchemas) -> Schema:
    """What is asked of a component in a file that extends no other one."""
    schema = whole.parameters(parameters)
    required = {"required": ["parameters"]} if "required" in schema else {}
    return {"properties": {"parameters": schema}, **required}


def _add_algorithms(coupling: Schema, part: ParameterSchemas) -> None:
    found = _loaded(base.installed(), base.algorithm_type)
    names = [{"const": name, "description": description(kind)} for name, kind in found.items()]
    algorithm = coupling["properties"]["algorithm"]
    algorithm["anyOf"] = [*names, {"type": "string", "minLength": 1}]
    conditions = [
        _if_is("algorithm", name, _also("algorithm", part.parameters(declared(kind))))
        for name, kind in found.items()
    ]
    _add_all(coupling, conditions)


def _also(key: str, parameters: Schema) -> Schema:
    """Parameters beside another key; `null` takes back what a base says for another algorithm."""
    properties = {key: {}, **parameters["properties"]}
    return {**parameters, "properties": properties, "additionalProperties": {"type": "null"}}


def _mapping(schema: Schema) -> Schema:
    """The form that is a mapping, of a value that may be `null`."""
    (found,) = (form for form in schema["anyOf"] if form.get("type") == "object")
    return cast("Schema", found)


def _add_reports(entry: Schema, part: ParameterSchemas) -> None:
    found = _loaded(report.installed(), report.report_type)
    conditions = [
        _if_is("type", name, {"properties": {"parameters": part.parameters(declared(kind))}})
        for name, kind in found.items()
    ]
    _add_all(entry, conditions)


def _add_measures(measures: Schema, part: ParameterSchemas) -> None:
    found = _loaded(measure.installed(), measure.measure_type)
    schemas = {name: part.parameters(declared(kind)) for name, kind in found.items()}
    measures["properties"] = {
        name: {
            "description": description(found[name]),
            "if": {"type": "object", "not": {"required": ["type"]}},
            "then": schema,
        }
        for name, schema in schemas.items()
    }
    (entry,) = measures["patternProperties"].values()
    conditions = [
        _if_is("type", name, {**schema, "properties": {"type": {}, **schema["properties"]}})
        for name, schema in schemas.items()
    ]
    _add_all(entry, conditions)


def _add_all(schema: Schema, conditions: list[Schema]) -> None:
    if conditions:  # an empty `allOf` is no schema
        schema["allOf"] = conditions


def _if_is(key: str, value: str, then: Schema) -> Schema:
    is_value = {"type": "object", "properties": {key: {"const": value}}, "required": [key]}
    return {"if": is_value, "then": then}


def _loaded(offers: Mapping[str, Any], load: Callable[[str], type]) -> dict[str, type]:
    """What can be loaded, by name."""
    found = {}
    for name in offers:
        try:
            found[name] = load(name)
        except ComponentTypeError:
            continue  # the run says so to those who ask for it
    return found
