"""Every type in fixed sizes; outputs depend on inputs and on the time, so that they never stay."""

from fmus.native.interface import (
    Interface,
    Options,
    Variable,
    VariableType,
    discrete_input,
    discrete_output,
)
from tests.fmus.every_type import COLOURS, MIME, TYPES


def _pair(kind: VariableType) -> tuple[Variable, Variable]:
    name = kind.lower()
    items = COLOURS if kind == "Enumeration" else ()
    axes = () if kind in {"Float32", "Int64"} else (3,)
    both = Options(dimensions=axes, start=1, items=items)
    given = discrete_input(f"{name}.in", kind, f"{kind} values", **both)
    return given, discrete_output(f"{name}.out", kind, f"{kind} values, changed", **both)


INTERFACE = Interface(
    name="mirror",
    description="Outputs are made of the inputs and the time",
    variables=(
        *(variable for kind in TYPES for variable in _pair(kind)),
        discrete_input("payload", "Binary", "any bytes", mime_type=MIME),
        discrete_output("copy", "Binary", "the same and more", mime_type=MIME),
    ),
    sources=("mirror.c",),
)
