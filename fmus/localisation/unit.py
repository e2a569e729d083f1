"""The localisation of vehicles: their scans come with the poses that they believe to have."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.localisation.pose_errors import Accuracy, Offsets, PoseErrors
from fmus.localisation.stamping import sensing, stamped
from fmus.messages.connectors import SIGNALS, inputs, outputs, when_undriven
from orchestrator.absence import Need, Undriven
from orchestrator.component import Component
from orchestrator.parameters import DRAWN, parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

INPUTS: Final[Mapping[str, Connector]] = when_undriven(
    inputs("vehicle.id", "points"),
    {
        "vehicle.id": Undriven("there are no vehicles, and nobody is wrong about anything"),
        "points": Undriven("there are no scans to come with a pose", Need.IF_OFFERED),
    },
)
OUTPUTS: Final[Mapping[str, Connector]] = {
    "located.points": replace(
        SIGNALS["points"],
        causality=Causality.OUTPUT,
        feedthrough=frozenset(INPUTS),
        description="The scans; position and heading of each sensor as its vehicle believes",
    ),
    **outputs(
        "pose_error.vehicle", "pose_error.position", "pose_error.heading", feedthrough=INPUTS
    ),
}


class Localisation(Component):
    """Lets vehicles be wrong about their poses, as with satellite navigation.

    It stands between the lidar and whoever reads its scans. In `located.points` the positions and
    headings of their sensors are what the vehicles believe, and everything made of the scans
    follows: matrices, objects, features, blind zones. `pose_error` says by how much each vehicle is
    wrong, for the driving policies: what the ego sees itself it knows relative to itself, whatever
    it believes.

    Step it with the lidar: a scan gets the error at the communication point at which it comes.
    docs/physics-localisation.md has the model.
    """

    connectors: Final = {**INPUTS, **OUTPUTS}

    @dataclass(frozen=True, slots=True, kw_only=True)
    class _Parameters:
        """Parameters of the localisation."""

        position_error: float = parameter(
            0.0, unit="m", minimum=0.0, maximum=1e4,
            doc="standard deviation of each coordinate of the position a vehicle believes to have",
        )  # fmt: skip
        heading_error: float = parameter(
            0.0, unit="rad", minimum=0.0, maximum=3.2,
            doc="standard deviation of the heading a vehicle believes to have",
        )  # fmt: skip
        correlation_time: float = parameter(
            30.0, unit="s", minimum=0.0, maximum=1e6,
            doc="how long these errors last; 0: they are independent at every step",
        )  # fmt: skip
        seed: int = parameter(DRAWN, doc="selects the random numbers of these errors")

    Parameters: TypeAlias = _Parameters

    def __init__(self, parameters: _Parameters) -> None:
        self._accuracy = Accuracy(
            position=parameters.position_error,
            heading=parameters.heading_error,
            correlation=nanoseconds(parameters.correlation_time),
        )
        seed: object = parameters.seed
        self._seed = seed if isinstance(seed, int) else None

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        drawn = int(rng.integers(2**63))
        self._errors = PoseErrors(self._accuracy, drawn if self._seed is None else self._seed)
        self._start = start
        self._given = b""
        self._stamped = b""
        self._offsets = self._errors.at(np.empty(0, np.int64), start)

    @override
    def initialise(self, inputs: Signals) -> None:
        self._locate(inputs, self._start)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._locate(inputs, t + h)

    @override
    def outputs(self) -> Signals:
        offsets = self._offsets
        return {
            "located.points": self._stamped,
            "pose_error.vehicle": offsets.vehicle,
            "pose_error.position": offsets.position,
            "pose_error.heading": offsets.heading,
        }

    def _locate(self, inputs: Signals, now: Time) -> None:
        """Let everybody believe what he does at `now`, and stamp the scans if they are new."""
        present = np.asarray(inputs["vehicle.id"], np.int64)
        points = bytes(inputs["points"])
        is_new = points != self._given
        seeing = sensing(points) if is_new else np.empty(0, np.int64)
        offsets = self._errors.at(np.concatenate([present, seeing]), now)
        if is_new:
            self._given = points
            self._stamped = points if self._accuracy.is_perfect else stamped(points, offsets)
        rows = offsets.rows(np.unique(present))
        self._offsets = Offsets(
            vehicle=offsets.vehicle[rows],
            position=offsets.position[rows],
            heading=offsets.heading[rows],
        )
