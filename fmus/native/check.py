"""What an `Interface` must satisfy before anything is generated from it."""

import re
from collections import Counter
from typing import Final

import numpy as np

from fmus.native.interface import Interface, Variable
from fmus.native.units import UNITS

MAX_RANK: Final = 4  # MAX_RANK in fmi3_instance.h
FLOATS: Final = frozenset({"Float32", "Float64"})
NOT_NUMERIC: Final = frozenset({"Boolean", "Enumeration", "Binary"})
_VARIABILITIES: Final = {
    "structuralParameter": {"fixed", "tunable"},
    "parameter": {"fixed", "tunable"},
    "input": {"discrete", "continuous"},
    "output": {"discrete", "continuous"},
}
_ITEM: Final = re.compile(r"(?!(null|true|false)$)[a-z][a-z0-9_]*")
"""Items are written in scenario files, where `null` and the like are no text."""
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")


class InterfaceError(Exception):
    """The table of a unit's variables is wrong; one line per problem."""


def c_name(name: str) -> str:
    """The name of a variable in C, where its value reference is `VR_` and this name."""
    return name.replace(".", "_")


def type_name(name: str) -> str:
    """The type of the Enumeration `name`; no variable may be called so (FMI 3.0.2, 2.4.4)."""
    return f"{name}.item"


def check_interface(interface: Interface) -> None:
    """Refuse an interface that FMI or the shell could not express.

    Raises:
        InterfaceError: with every problem found.
    """
    names = {variable.name: variable for variable in interface.variables}
    types = [type_name(v.name) for v in interface.variables if v.type == "Enumeration"]
    declared = [*_names(interface), "time", *types]
    problems = [f"`{name}` is declared twice" for name in _twice(declared)]
    problems += [
        f"two variables are called `VR_{name}` in C"
        for name in _twice([c_name(name) for name in {*_names(interface), "time"}])
    ]
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", interface.name):
        problems.append(f"`{interface.name}` is no C identifier")
    for variable in interface.variables:
        found = [
            *_problems_of_kind(variable),
            *_problems_of_values(variable),
            *_problems_of_items(variable),
            *_problems_of_references(variable, names),
        ]
        problems += [f"`{variable.name}` {problem}" for problem in found]
    if problems:
        raise InterfaceError("\n".join(f"{interface.name}: {problem}" for problem in problems))


def _names(interface: Interface) -> list[str]:
    return [variable.name for variable in interface.variables]


def _twice(names: list[str]) -> list[str]:
    return sorted(name for name, count in Counter(names).items() if count > 1)


def _problems_of_kind(variable: Variable) -> list[str]:
    found = []
    if not _NAME.fullmatch(variable.name):
        found.append("is no structured name")
    if variable.variability not in _VARIABILITIES[variable.causality]:
        found.append(f"is {variable.causality} and cannot be {variable.variability}")
    if variable.variability == "continuous" and variable.type not in FLOATS:
        found.append(f"is {variable.type} and cannot be continuous")
    if variable.unit not in UNITS:
        found.append(f"has the unit `{variable.unit}`, which fmus/native/units.py does not define")
    elif variable.unit != "1" and variable.type not in FLOATS:
        found.append(f"is {variable.type}; FMI 3.0 has units for Float32 and Float64 only")
    if variable.type == "Binary" and variable.dimensions:
        found.append("is Binary and cannot be an array")
    if variable.type == "Binary" and variable.causality == "parameter":
        found.append("is Binary and cannot be a parameter")
    if len(variable.dimensions) > MAX_RANK:
        found.append(f"has more than {MAX_RANK} dimensions")
    if variable.causality == "structuralParameter" and (
        variable.type != "UInt64" or variable.dimensions
    ):
        found.append("is a structural parameter and must be a scalar UInt64")
    return found


def _limits(variable: Variable) -> tuple[float, float]:
    if variable.type in FLOATS:
        limit = float(np.finfo(variable.type.lower()).max)
        return -limit, limit
    limits = np.iinfo(variable.type.lower())
    return int(limits.min), int(limits.max)


def _problems_of_values(variable: Variable) -> list[str]:
    if variable.type in NOT_NUMERIC:
        is_bounded = variable.minimum is not None or variable.maximum is not None
        return [f"is {variable.type} and has no bounds"] if is_bounded else []
    found = []
    lowest, highest = _limits(variable)
    low = lowest if variable.minimum is None else variable.minimum
    high = highest if variable.maximum is None else variable.maximum
    for what, number in (("start", variable.start), ("minimum", low), ("maximum", high)):
        if not lowest <= number <= highest:
            found.append(f"has the {what} {number}, which {variable.type} cannot hold")
        elif variable.type not in FLOATS and number != int(number):
            found.append(f"has the {what} {number}, which is no integer")
    if not low <= variable.start <= high:
        found.append(f"starts at {variable.start}, outside [{low}, {high}]")
    if variable.causality == "structuralParameter" and variable.start < 1:
        # FMI 3.0.2, 2.4.7.3: the start value of a dimension is positive; its min may be 0
        found.append("is a structural parameter and must start at 1 or more")
    return found


def _problems_of_items(variable: Variable) -> list[str]:
    items = variable.items
    if variable.type != "Enumeration":
        return [f"is {variable.type} and has no items"] if items else []
    found = [] if items else ["is an Enumeration without items"]
    found += [
        f"has the item `{item}`; write a word in lower case, letters, digits and `_`"
        for item in items
        if not _ITEM.fullmatch(item)
    ]
    found += [f"has the item `{item}` twice" for item in _twice(list(items))]
    if items and variable.start not in range(1, len(items) + 1):
        found.append(f"starts at {variable.start}; its items are 1 to {len(items)}")
    return found


def _problems_of_references(variable: Variable, names: dict[str, Variable]) -> list[str]:
    found = []
    for axis in variable.dimensions:
        if isinstance(axis, int):
            if axis < 1:
                found.append(f"has an axis of length {axis}")
        elif axis not in names or names[axis].causality != "structuralParameter":
            found.append(f"has the axis `{axis}`, which is no structural parameter")
    if variable.dependencies and variable.causality != "output":
        found.append(f"is {variable.causality} and has no dependencies")
    return found + [
        f"depends on `{name}`, which is no input"
        for name in variable.dependencies
        if name not in names or names[name].causality != "input"
    ]
