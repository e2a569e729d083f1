"""The FMUs that are installed, as the orchestrator drives them: components with connectors."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from fmus.localisation import Accuracy, PoseErrors, stamped
from fmus.messages.apm import join, split
from fmus.messages.records import OBJECT, POINT, SENSOR, frame, unframe
from orchestrator.errors import ComponentError
from orchestrator.parameters import ComponentType
from orchestrator.signal import Array, Causality, Signal, Signals
from studies.verification.perception.parameter_set import ParameterSet
from studies.verification.perception.scene import Float, Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """What the perception unit tells the ego vehicle.

    Attributes:
        centers: of the blind zones [m], shape (zone, 2).
        ranges: half their sides [m], shape (zone,).
        sharers: ids, best first.
        benefits: of the sharers [m^2], shape (sharer,).
        trigger: whether any sharer's data pays.
    """

    centers: Float
    ranges: Float
    sharers: tuple[int, ...]
    benefits: Float
    trigger: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Scans:
    """One scan of every equipped vehicle of a scene.

    Attributes:
        points: the signal of the lidar unit.
        ego_points: the same signal with the ego vehicle's scan alone.
        counts: number of points, by vehicle.
    """

    points: bytes
    ego_points: bytes
    counts: Mapping[int, int]

    def on_ground(self, vehicle: int) -> Float:
        """Find the points of one vehicle's scan as seen from above; its sensor is level.

        Returns:
            Positions in the world frame [m], shape (point, 2).
        """
        sensors, points = _unpacked(self.points)
        (sensor,) = sensors[sensors["vehicle"] == vehicle]
        first = int(sensor["first"])
        local = points["position"][first : first + int(sensor["count"]), :2].astype(np.float64)
        cosine, sine = np.cos(sensor["heading"]), np.sin(sensor["heading"])
        turned: Float = local @ np.array([[cosine, sine], [-sine, cosine]])
        turned += sensor["position"][:2]
        return turned

    def believed(self, accuracy: Accuracy, seed: int) -> "Scans":
        """Scans with the poses that their vehicles believe to have; points stay as they are."""
        if accuracy.is_perfect:
            return self
        vehicles = np.array(sorted(self.counts), np.int64)
        offsets = PoseErrors(accuracy, seed).at(vehicles, 0)
        points, alone = (stamped(one, offsets) for one in (self.points, self.ego_points))
        return replace(self, points=points, ego_points=alone)


class UnitsUnderTest:
    """The lidar and the perception unit. Every call is a new instance at time 0.

    Whatever an instance raises becomes a `ComponentError`.

    Args:
        lidar: what is installed under this name.
        perception: likewise.
    """

    def __init__(self, lidar: ComponentType, perception: ComponentType) -> None:
        self._lidar = lidar
        self._perception = perception

    def scan(self, scene: Scene, seed: int) -> Scans:
        """Scan once from every equipped vehicle, with the lidar's default parameters and noise."""
        signals = _start(self._lidar, "lidar", {"seed": seed}, scene.inputs())
        data = cast("bytes", signals["points"])
        sensors, points = _unpacked(data)
        (own,) = np.flatnonzero(sensors["vehicle"] == scene.ego)
        sensor = sensors[own : own + 1].copy()
        first, count = int(sensor["first"][0]), int(sensor["count"][0])
        sensor["first"] = 0
        alone = frame("LPTS", sensor, points[first : first + count].tobytes())
        counts = {int(one["vehicle"]): int(one["count"]) for one in sensors}
        return Scans(points=data, ego_points=alone, counts=counts)

    def apms(
        self, scene: Scene, scans: Scans, parameters: Mapping[str, Any]
    ) -> tuple[list[bytes], Array]:
        """Make the APM messages of all equipped vehicles.

        Returns:
            The messages, and OBJECT records of what the vehicles see, shape (object,).
        """
        inputs = {"points": scans.points, **_map(scene)}
        signals = _start(self._perception, "perception", parameters, inputs)
        objects = unframe("OBJS", cast("bytes", signals["objects"]), OBJECT)
        return split(cast("bytes", signals["apms"])), objects

    def match(
        self,
        scene: Scene,
        scans: Scans,
        messages: Iterable[bytes],
        choice: ParameterSet,
        road: Signals | None = None,
    ) -> Match:
        """Match the ego vehicle's scan with the `messages`; its own may be among them.

        Args:
            scene: what there is.
            scans: of all equipped vehicles.
            messages: the APMs that reached the ego vehicle.
            choice: the parameters of its perception unit.
            road: `road.vertex` and `road.index`; `None`: the border of the road of `scene`.
        """
        inputs: dict[str, Signal] = {
            "points": scans.ego_points,
            "received": join(messages),
            "ego.id": np.array(scene.ego),
            "route.vertex": scene.route,
            **_map(scene),
        }
        if choice.uses_road and road is not None:
            inputs |= road
        elif choice.uses_road:
            ring = np.array(scene.road.exterior.coords)[:-1]
            inputs["road.vertex"] = ring
            inputs["road.index"] = np.zeros(len(ring), np.int32)
        signals = _start(self._perception, "perception", choice.values, inputs)
        ranges = cast("Array", signals["blind_zone.range"])
        sharers = cast("Array", signals["match.sharer"])
        used = sharers >= 0
        return Match(
            centers=cast("Array", signals["blind_zone.center"])[ranges > 0],
            ranges=ranges[ranges > 0],
            sharers=tuple(int(one) for one in sharers[used]),
            benefits=cast("Array", signals["match.benefit"])[used],
            trigger=bool(signals["match.trigger"]),
        )


def _unpacked(data: bytes) -> tuple[Array, Array]:
    """SENSOR and POINT records of a signal of points."""
    sensors = unframe("LPTS", data, SENSOR)
    return sensors, np.frombuffer(data, POINT, -1, 16 + sensors.nbytes)


def _map(scene: Scene) -> dict[str, Signal]:
    """The footprints of the buildings, which are on every map."""
    signals = scene.inputs()
    return {name: signals[name] for name in ("building.vertex", "building.index")}


def _start(
    component_type: ComponentType, name: str, parameters: Mapping[str, Any], inputs: Signals
) -> Signals:
    """The outputs of a new instance at its first communication point."""
    try:
        component = component_type.create(name, parameters)
        try:
            values = {
                connector: declared.start_value()
                for connector, declared in component.connectors.items()
                if declared.causality is Causality.INPUT
            }
            for connector, value in inputs.items():
                if isinstance(value, np.ndarray):
                    value.flags.writeable = False
                values[connector] = value
            component.setup(0, np.random.default_rng(0))
            component.initialise(values)
            return component.outputs()
        finally:
            component.close()
    except Exception as error:
        raise ComponentError(name, 0, str(error)) from error
