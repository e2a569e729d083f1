"""First-order lags with private state."""

from dataclasses import replace

from fmus.native.interface import (
    Interface,
    discrete_input,
    discrete_output,
    length,
    parameter,
    whole,
)

_U = discrete_input("u", "Float64", "input of each lag", dimensions=("n_channel",))
_X = discrete_output("x", "Float64", "state of each lag", dimensions=("n_channel",))

INTERFACE = Interface(
    name="lag",
    description="T dx/dt = u - x for each channel; the outputs are x",
    variables=(
        length("n_channel", 1, 1, 1000, "number of lags", tunable=False),
        parameter("time_constant", 2, 0.001, None, "T", unit="s"),
        parameter("initial", 1, None, None, "x at the start"),
        whole("seed", 0, None, None, "shown by the output `seed_used`", kind="Int64"),
        replace(_U, variability="continuous"),
        replace(_X, variability="continuous"),
        discrete_output("seed_used", "Int64", "the parameter `seed`"),
    ),
    sources=("lag.c",),
)
