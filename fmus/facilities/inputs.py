"""What the facilities layer reads."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from fmus.facilities.connectors import UNNAMED, of_ego
from fmus.messages.apm import split
from fmus.messages.features import FeaturesMessage, read_features
from fmus.messages.pose_errors import PoseErrors
from fmus.messages.records import OBJECT, RECEPTION, unframe
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vehicles:
    """The inputs `vehicle.*`: every vehicle on the scene, by ascending id.

    Attributes:
        id: numbers of the vehicles, int64, shape (vehicle,).
        position: centres of the footprints, world frame [m], float64, shape (vehicle, 3).
        heading: counter-clockwise from east [rad], float64, shape (vehicle,).
        velocity: world frame [m/s], float64, shape (vehicle, 2).
        size: length, width and height [m], float64, shape (vehicle, 3).
        antenna_height: above the ground [m], float64, shape (vehicle,).
        equipped: whether the vehicle has a radio, bool, shape (vehicle,).
    """

    id: npt.NDArray[np.int64]
    position: npt.NDArray[np.float64]
    heading: npt.NDArray[np.float64]
    velocity: npt.NDArray[np.float64]
    size: npt.NDArray[np.float64]
    antenna_height: npt.NDArray[np.float64]
    equipped: npt.NDArray[np.bool_]

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The vehicles in the inputs of a step: every field is the connector `vehicle.<field>`."""
        return cls(**{name: np.asarray(signals[f"vehicle.{name}"]) for name in cls.__slots__})

    def is_same(self, other: "Vehicles") -> bool:
        """Whether all arrays are the very objects of `other`: traffic has not gone on since."""
        return all(map(operator.is_, _ARRAYS(self), _ARRAYS(other)))

    def with_radio(self) -> list[int]:
        """The numbers of the vehicles that have a radio, ascending."""
        numbers: list[int] = self.id[self.equipped].tolist()
        return numbers


_ARRAYS: Final = operator.attrgetter(*Vehicles.__slots__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlindZones:
    """The inputs `blind_zone.*`: squares along the ego vehicle's heading.

    Attributes:
        centers: world frame [m], float64, shape (blind_zone, 2).
        ranges: half the sides [m], float64, shape (blind_zone,); 0 where an entry is not in use.
    """

    centers: npt.NDArray[np.float64]
    ranges: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EgoInputs:
    """What concerns one ego vehicle.

    Attributes:
        vehicle: its number; `NO_VEHICLE` while it is not there.
        sharers: vehicles whose data pay, the best first, int64, shape (sharer,); `NO_VEHICLE` in
            unused entries.
        trigger: whether any sharer's data pay.
        blind_zones: where it is blind.
        relay: the vehicle that relays the sharer's data; `NO_VEHICLE` for the direct link.
    """

    vehicle: int
    sharers: npt.NDArray[np.int64]
    trigger: bool
    blind_zones: BlindZones
    relay: int

    @classmethod
    def read(cls, signals: Signals, ego: str) -> Self:
        """What concerns the ego of this name in the inputs of a step."""
        return cls(
            vehicle=int(np.asarray(signals[of_ego(ego, "ego.id")])),
            sharers=np.asarray(signals[of_ego(ego, "match.sharer")]),
            trigger=bool(signals[of_ego(ego, "match.trigger")]),
            blind_zones=BlindZones(
                centers=np.asarray(signals[of_ego(ego, "blind_zone.center")]),
                ranges=np.asarray(signals[of_ego(ego, "blind_zone.range")]),
            ),
            relay=int(np.asarray(signals[of_ego(ego, "relay")])),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """The inputs of one step.

    Scans hold their value over many steps, so the signals made of them are decoded by methods,
    for those who found them new.

    Attributes:
        vehicles: every vehicle on the scene.
        egos: what concerns each ego vehicle, in the order of their names.
        apms: an "APMS" signal, of the last scans.
        objects: an "OBJS" signal, of the last scans.
        features: a "FEAT" signal, of the last scans.
        receptions: an "RCPT" signal, of the last step.
        errors: by how much vehicles are wrong about their poses.
    """

    vehicles: Vehicles
    egos: Sequence[EgoInputs]
    apms: bytes
    objects: bytes
    features: bytes
    receptions: bytes
    errors: PoseErrors

    @classmethod
    def read(cls, signals: Signals, egos: Sequence[str] = (UNNAMED,)) -> Self:
        """The inputs of a step; what is the same object as before stays it.

        Args:
            signals: by name.
            egos: names of the egos.
        """
        return cls(
            vehicles=Vehicles.read(signals),
            egos=[EgoInputs.read(signals, ego) for ego in egos],
            apms=bytes(signals["apms"]),
            objects=bytes(signals["objects"]),
            features=bytes(signals["features"]),
            receptions=bytes(signals["receptions"]),
            errors=PoseErrors.read(signals),
        )

    def apm_messages(self) -> list[bytes]:
        """The APMs of the last scans, as sent and not decoded."""
        return split(self.apms)

    def object_records(self) -> Array:
        """The objects tracked in the last scans, `OBJECT` records of shape (object,)."""
        return unframe("OBJS", self.objects, OBJECT)

    def feature_messages(self) -> list[FeaturesMessage]:
        """The features of the last scans, one message per scan."""
        return read_features(self.features)

    def reception_records(self) -> Array:
        """The frames that ended in the last step, `RECEPTION` records of shape (reception,)."""
        return unframe("RCPT", self.receptions, RECEPTION)
