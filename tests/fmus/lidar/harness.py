"""Drives the lidar FMU: scenes in, point clouds out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.bodies import Body
from fmus.messages.records import POINT, SENSOR, unframe
from orchestrator.signal import Array
from tests.fmus.driver import Instance, Library
from tests.fmus.scene import Scene

CAR, SUV, VAN, BUS, TRUCK, RAIL, MOTORCYCLE, BICYCLE, PEDESTRIAN = Body
NO_NOISE: Final = {"range_noise": 0.0, "dropout": 0.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cloud:
    """What one sensor saw."""

    sensor: Array  # SENSOR, shape ()
    points: Array  # POINT, shape (points,)

    @property
    def instances(self) -> set[int]:
        """Everything that was hit."""
        return set(map(int, self.points["instance"]))

    @property
    def distance(self) -> Array:
        """Of each point from the sensor [m], shape (points,)."""
        position: Array = self.points["position"].astype(float)
        return np.asarray(np.linalg.norm(position, axis=1))

    def on(self, instance: int) -> Array:
        """The points on one instance."""
        chosen: Array = self.points[self.points["instance"] == instance]
        return chosen


def clouds(data: bytes) -> dict[int, Cloud]:
    """The clouds in a `points` signal, by vehicle; asserts that the signal is complete."""
    sensors = unframe("LPTS", data, SENSOR)
    points = np.frombuffer(data, POINT, -1, 16 + sensors.nbytes)
    assert sensors["count"].sum() == len(points)
    assert (np.cumsum(sensors["count"]) - sensors["count"] == sensors["first"]).all()
    return {
        int(s["vehicle"]): Cloud(sensor=s, points=points[s["first"] : s["first"] + s["count"]])
        for s in sensors
    }


class Lidar(Instance):
    """One instance, in initialisation mode; without a scene its inputs have start values."""

    def __init__(self, library: Library, scene: Scene | None, **parameters: float) -> None:
        super().__init__(library)
        for name, value in parameters.items():
            self.set(name, np.array(value))
        if scene is not None:
            self.resize(**scene.lengths())
        self.enter_initialization()
        if scene is not None:
            self.set_inputs(scene)

    def set_inputs(self, scene: Scene) -> None:
        """Set every input; the arrays have their sizes already."""
        for name, value in scene.inputs(self.library).items():
            self.set(name, value)

    def start(self) -> "Lidar":
        """Leave initialisation mode."""
        self.call("ExitInitializationMode")
        return self

    def step(self, t: float, h: float) -> None:
        """Advance from t to t + h."""
        self.do_step(t, h)

    def points(self) -> bytes:
        """The output."""
        return self.get_binary("points")


Scan = Callable[..., dict[int, Cloud]]


def scanner(library: Library) -> Scan:
    """A function (scene, **parameters) that scans once at t = 0."""

    def scan(scene: Scene, **parameters: float) -> dict[int, Cloud]:
        lidar = Lidar(library, scene, **parameters)
        try:
            return clouds(lidar.start().points())
        finally:
            lidar.free()

    return scan
