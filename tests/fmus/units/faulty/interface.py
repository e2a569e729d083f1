"""Fails on demand."""

from dataclasses import replace

from fmus.native.interface import Interface, discrete_output, switch, whole

INTERFACE = Interface(
    name="faulty",
    description="After t = 0.3 s each step returns the status `kind`, or outputs NaN",
    variables=(
        whole("kind", 0, 0, 5, "a ModelStatus; 5: the output is NaN"),
        switch("warns", "before, each step gives a warning; the failure has no words", start=False),
        switch("refuse", "fail in initialisation", start=False),
        replace(discrete_output("y", "Float64", "the time", unit="s"), variability="continuous"),
    ),
    sources=("faulty.c",),
)
