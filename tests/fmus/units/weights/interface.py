"""A matrix of parameters as wide as an input is long."""

from dataclasses import replace

from fmus.native.interface import Interface, discrete_input, discrete_output, length, parameter

_U = discrete_input("u", "Float64", "what is weighted", dimensions=("n_in",))
_Y = discrete_output("y", "Float64", "w u", dimensions=("n_out",), dependencies=("u",))

INTERFACE = Interface(
    name="weights",
    description="y = w u",
    variables=(
        length("n_in", 2, 0, 10, "length of the input", tunable=True),
        length("n_out", 3, 1, 10, "length of the output", tunable=True),
        parameter("w", 1, None, None, "row by row", dimensions=("n_out", "n_in")),
        replace(_U, start=2),
        _Y,
    ),
    sources=("weights.c",),
)
