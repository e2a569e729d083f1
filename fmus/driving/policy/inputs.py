"""What driving policies read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from fmus.driving.policy.belief import Belief
from fmus.driving.policy.connectors import INPUTS
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.occupancy import Vehicles
from fmus.messages.features import FeaturesMessage, read_features
from fmus.messages.records import OBJECT, unframe
from orchestrator.signal import Array, Signal, Signals

_NOTHING: Final[Mapping[str, Signal]] = {name: one.start_value() for name, one in INPUTS.items()}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """What a driving policy knows at one communication point.

    A policy declares the signals that it reads; fields of other signals hold start values, zero or
    empty, whatever is connected. So the truth about other vehicles is known to those alone that
    declare it.

    All places are where the ego vehicle believes them to be: if it is wrong about its pose, then
    the ego, its route and the truth about others are moved as one body to where it believes to be.
    What sensors see is there already.

    Attributes:
        ego: the ego vehicle.
        points: scans of all lidars, an "LPTS" Binary signal; `fmus.driving.network.cloud` reads it.
        seen: what the ego's own lidar sees, `OBJECT` records, shape (object,).
        received: what others see and the radio delivered, `OBJECT` records, shape (object,); when a
            policy is to `drive`, without those that are the ego itself.
        features: keypoints of others that the radio delivered, a "FEAT" Binary signal.
        vehicles: the truth about all vehicles, the ego among them.
    """

    ego: Ego
    points: bytes
    seen: Array
    received: Array
    features: bytes
    vehicles: Vehicles

    def messages(self) -> list[FeaturesMessage]:
        """The messages in `features`, none without any."""
        return read_features(self.features)

    @classmethod
    def read(cls, signals: Signals, reads: frozenset[str]) -> Self:
        """The view of the inputs of a driving policy.

        Args:
            signals: the inputs by name.
            reads: names of those that the policy declares.
        """
        given = {**_NOTHING, **{name: signals[name] for name in reads}}
        size = np.asarray(given["ego.size"], np.float64)
        ego = Ego(
            vehicle=int(np.asarray(given["ego.id"], np.int64)),
            position=np.asarray(given["ego.position"], np.float64),
            heading=float(np.asarray(given["ego.heading"], np.float64)),
            speed=float(np.asarray(given["ego.speed"], np.float64)),
            length=float(size[0]),
            width=float(size[1]),
            route=np.asarray(given["ego.route"], np.float64),
        )
        objects = unframe("OBJS", bytes(given["objects"]), OBJECT)
        vehicles = Vehicles(
            number=np.asarray(given["vehicle.id"], np.int64),
            center=np.asarray(given["vehicle.position"], np.float64)[:, :2],
            heading=np.asarray(given["vehicle.heading"], np.float64),
            size=np.asarray(given["vehicle.size"], np.float64)[:, :2],
            velocity=np.asarray(given["vehicle.velocity"], np.float64),
        )
        if belief := Belief.of(ego, given):
            ego, vehicles = belief.ego(ego), belief.vehicles(vehicles)
        return cls(
            ego=ego,
            points=bytes(given["points"]),
            seen=objects.compress(objects["sensor"] == ego.vehicle),
            received=unframe("OBJS", bytes(given["received.objects"]), OBJECT),
            features=bytes(given["received.features"]),
            vehicles=vehicles,
        )
