"""First-order lags with private state."""

from fmus.native.interface import Interface, Variable

INTERFACE = Interface(
    name="lag",
    description="T dx/dt = u - x for each channel; the outputs are x",
    variables=(
        Variable(
            name="n_channel",
            type="UInt64",
            causality="structuralParameter",
            variability="fixed",
            description="number of lags",
            start=1,
            minimum=1,
            maximum=1000,
        ),
        Variable(
            name="time_constant",
            type="Float64",
            causality="parameter",
            variability="fixed",
            description="T",
            unit="s",
            start=2,
            minimum=0.001,
        ),
        Variable(
            name="initial",
            type="Float64",
            causality="parameter",
            variability="fixed",
            description="x at the start",
            start=1,
        ),
        Variable(
            name="seed",
            type="Int64",
            causality="parameter",
            variability="fixed",
            description="shown by the output `seed_used`",
        ),
        Variable(
            name="u",
            type="Float64",
            causality="input",
            variability="continuous",
            description="input of each lag",
            dimensions=("n_channel",),
        ),
        Variable(
            name="x",
            type="Float64",
            causality="output",
            variability="continuous",
            description="state of each lag",
            dimensions=("n_channel",),
        ),
        Variable(
            name="seed_used",
            type="Int64",
            causality="output",
            variability="discrete",
            description="the parameter `seed`",
        ),
    ),
    sources=("lag.c",),
)
