"""Every type as an input and, one to one, as an output."""

from dataclasses import replace

from fmus.native.interface import (
    Interface,
    Options,
    Variable,
    VariableType,
    discrete_input,
    discrete_output,
    length,
)
from tests.fmus.every_type import COLOURS, MIME, TYPES


def _pair(kind: VariableType) -> tuple[Variable, Variable]:
    name = kind.lower()
    items = COLOURS if kind == "Enumeration" else ()
    both = Options(dimensions=("n_element",), start=1, items=items)
    given = discrete_input(f"{name}.in", kind, f"{kind} values", **both)
    shown = discrete_output(f"{name}.out", kind, f"{kind} values, as they came", **both)
    return given, replace(shown, dependencies=(given.name,))


INTERFACE = Interface(
    name="echo",
    description="Outputs are the inputs, bit for bit",
    variables=(
        length("n_element", 3, 0, 1_000_000, "length of the arrays"),
        *(variable for kind in TYPES for variable in _pair(kind)),
        discrete_input("payload", "Binary", "any bytes", mime_type=MIME),
        discrete_output(
            "copy", "Binary", "the same bytes", mime_type=MIME, dependencies=("payload",)
        ),
    ),
    sources=("echo.c",),
)
