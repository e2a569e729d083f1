"""Rows of a matrix: sizes by structural parameters, no private state."""

from dataclasses import replace

from fmus.native.interface import Interface, discrete_input, discrete_output, length, parameter

_GAIN = parameter("gain", 1, -10, 10, "factor of every row", unit="m")

INTERFACE = Interface(
    name="matrix",
    description="Scaled rows and their scalar products",
    variables=(
        length("n_row", 2, 0, 100000, "rows"),
        length("n_spare", 3, 1, 10, "length of `spare`", tunable=False),
        replace(_GAIN, variability="tunable"),
        parameter("offset", 0, None, None, "added to every element; `begin` stores it", unit="m"),
        discrete_input("row.value", "Float64", "the rows", dimensions=("n_row", 4), start=0.5),
        discrete_output(
            "row.scaled",
            "Float64",
            "gain * row + offset",
            unit="m",
            dimensions=("n_row", 4),
            dependencies=("row.value",),
        ),
        discrete_output(
            "product",
            "Float64",
            "scalar products of all pairs",
            dimensions=("n_row", "n_row"),
            dependencies=("row.value",),
        ),
        discrete_output("spare", "Int32", "0, 1, 2, ...", dimensions=("n_spare",)),
        discrete_output("begins", "Int32", "how often `begin` has run on the private state"),
    ),
    sources=("matrix.c",),
)
