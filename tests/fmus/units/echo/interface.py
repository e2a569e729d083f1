"""Every type as an input and, one to one, as an output."""

from typing import Final, get_args

from fmus.native.interface import Interface, Variable, VariableType

TYPES: Final = tuple(kind for kind in get_args(VariableType) if kind != "Binary")
COLOURS: Final = ("red", "green", "blue")


def _pair(kind: VariableType) -> tuple[Variable, Variable]:
    name = kind.lower()
    items = COLOURS if kind == "Enumeration" else ()
    return (
        Variable(
            name=f"{name}.in",
            type=kind,
            causality="input",
            variability="discrete",
            description=f"{kind} values",
            dimensions=("n_element",),
            start=1,
            items=items,
        ),
        Variable(
            name=f"{name}.out",
            type=kind,
            causality="output",
            variability="discrete",
            description=f"{kind} values, as they came",
            dimensions=("n_element",),
            dependencies=(f"{name}.in",),
            start=1,
            items=items,
        ),
    )


INTERFACE = Interface(
    name="echo",
    description="Outputs are the inputs, bit for bit",
    variables=(
        Variable(
            name="n_element",
            type="UInt64",
            causality="structuralParameter",
            variability="tunable",
            description="length of the arrays",
            start=3,
            minimum=0,
            maximum=1_000_000,
        ),
        *(variable for kind in TYPES for variable in _pair(kind)),
        Variable(
            name="payload",
            type="Binary",
            causality="input",
            variability="discrete",
            description="any bytes",
            mime_type="application/x-test; version=1",
        ),
        Variable(
            name="copy",
            type="Binary",
            causality="output",
            variability="discrete",
            description="the same bytes",
            mime_type="application/x-test; version=1",
            dependencies=("payload",),
        ),
    ),
    sources=("echo.c",),
)
