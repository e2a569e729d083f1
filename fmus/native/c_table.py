"""The variable table of a native unit in C: variables.h and variables.c."""

import json
import math

from fmus.native.check import c_name
from fmus.native.interface import Interface, Variable

_CAUSALITIES = {
    "structuralParameter": "STRUCTURAL_PARAMETER",
    "parameter": "PARAMETER",
    "input": "INPUT",
    "output": "OUTPUT",
}
_C_TYPES = {"Enumeration": "INT64"}  # FMI 3.0.2, 2.2.6.2: accessed by fmi3{Get|Set}Int64


def variables_header(interface: Interface) -> str:
    """The text of variables.h: the value reference of each variable as `VR_<name>`."""
    names = ["time", *(variable.name for variable in interface.variables)]
    width = max(map(len, names)) + 3
    lines = [f"#define {'VR_' + c_name(name):{width}} {k}u" for k, name in enumerate(names)]
    return "\n".join(
        [
            f"/* Value references of `{interface.name}`, generated from interface.py. */",
            "#ifndef VARIABLES_H",
            "#define VARIABLES_H",
            *lines,
            "#endif",
            "",
        ]
    )


def variables_source(interface: Interface, token: str) -> str:
    """The text of variables.c: one row of the shell's table for each variable."""
    references = {variable.name: k for k, variable in enumerate(interface.variables, start=1)}
    rows = [_row("time", "FLOAT64", "INDEPENDENT")]
    rows += [_variable_row(variable, references) for variable in interface.variables]
    return "\n".join(
        [
            f"/* Variables of `{interface.name}`, generated from interface.py. */",
            '#include "fmi3_instance.h"',
            "",
            "#include <math.h>",
            "",
            f"const char INSTANTIATION_TOKEN[] = {json.dumps(token)};",
            "const VariableInfo VARIABLES[] = {",
            *rows,
            "};",
            "const size_t VARIABLE_COUNT = sizeof VARIABLES / sizeof VARIABLES[0];",
            "",
        ]
    )


def _variable_row(variable: Variable, references: dict[str, int]) -> str:
    return _row(
        variable.name,
        _C_TYPES.get(variable.type, variable.type.upper()),
        _CAUSALITIES[variable.causality],
        is_tunable=variable.variability == "tunable",
        start=variable.start,
        bounds=(1, len(variable.items)) if variable.items else (variable.minimum, variable.maximum),
        items=variable.listed_items(),
        dimensions=[_dimension(axis, references) for axis in variable.dimensions],
    )


def _row(
    name: str,
    kind: str,
    causality: str,
    *,
    is_tunable: bool = False,
    start: float = 0,
    bounds: tuple[float | None, float | None] = (None, None),
    items: str = "",
    dimensions: list[str] | None = None,
) -> str:
    axes = dimensions or []
    low = -math.inf if bounds[0] is None else bounds[0]
    high = math.inf if bounds[1] is None else bounds[1]
    fields = [
        f".name = {json.dumps(name)}",
        f".type = {kind}",
        f".causality = {causality}",
        f".is_tunable = {str(is_tunable).lower()}",
        f".is_bounded = {str(bounds != (None, None)).lower()}",
        f".start = {_number(start)}",
        f".minimum = {_number(low)}",
        f".maximum = {_number(high)}",
        f".rank = {len(axes)}",
    ]
    if items:
        fields.append(f".items = {json.dumps(items)}")
    if axes:
        fields.append(f".dimensions = {{{', '.join(axes)}}}")
    return "    {" + ", ".join(fields) + "},"


def _number(value: float) -> str:
    if math.isinf(value):
        return "-INFINITY" if value < 0 else "INFINITY"
    return repr(float(value))


def _dimension(axis: int | str, references: dict[str, int]) -> str:
    if isinstance(axis, int):
        return f"{{.length = {axis}}}"
    return f"{{.is_structural = true, .reference = {references[axis]}}}"
