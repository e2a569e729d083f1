"""Parameters that are arrays or names: sizes chosen before the start, Enumerations."""

from dataclasses import replace

from fmus.native.interface import (
    Interface,
    choice,
    discrete_input,
    discrete_output,
    length,
    parameter,
)

_COLOUR = choice("sample.colour", ("red", "green", "blue"), "shown as it is")

INTERFACE = Interface(
    name="table",
    description="The gain at a position between samples",
    variables=(
        length("n_sample", 2, 1, 1000, "number of samples", tunable=False),
        choice("interpolation", ("hold", "linear"), "between samples"),
        parameter(
            "sample.gain", 1, -100, 100, "at 0, 1, 2, ...", unit="dB", dimensions=("n_sample",)
        ),
        parameter("sample.corner", 0, -1e3, 1e3, "shown as it is", dimensions=(2, "n_sample")),
        replace(_COLOUR, dimensions=("n_sample",), start=2),
        discrete_input("position", "Float64", "where to look"),
        discrete_output("gain", "Float64", "there", unit="dB", dependencies=("position",)),
        discrete_output("corner", "Float64", "`sample.corner`", dimensions=(2, "n_sample")),
        discrete_output("colour", "Int64", "`sample.colour`", dimensions=("n_sample",)),
    ),
    sources=("table.c",),
)
