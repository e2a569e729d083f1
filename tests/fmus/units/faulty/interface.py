"""Fails on demand."""

from fmus.native.interface import Interface, Variable

INTERFACE = Interface(
    name="faulty",
    description="After t = 0.3 s each step returns the status `kind`, or outputs NaN",
    variables=(
        Variable(
            name="kind",
            type="Int32",
            causality="parameter",
            variability="fixed",
            description="a ModelStatus; 5: the output is NaN",
            minimum=0,
            maximum=5,
        ),
        Variable(
            name="refuse",
            type="Boolean",
            causality="parameter",
            variability="fixed",
            description="fail in initialisation",
        ),
        Variable(
            name="y",
            type="Float64",
            causality="output",
            variability="continuous",
            description="the time",
            unit="s",
        ),
    ),
    sources=("faulty.c",),
)
