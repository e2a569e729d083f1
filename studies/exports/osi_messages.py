"""Messages of ASAM OSI 3: https://opensimulationinterface.github.io/osi-antora-generator.

OSI's world is that of the run: x east, y north, z up; angles are those of ISO 8855. The origin of a
vehicle is the centre of its box (`bbcenter_to_rear` is zero): runs know of no rear axle.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any, Final

import numpy as np

from adapters.traffic.bodies import Body
from adapters.traffic.geometry import rotate
from fmus.messages.records import BUILDING
from orchestrator.signal import Array
from studies.exports.export import module_for
from studies.exports.geo import Projection
from studies.exports.scene import Building, Snapshot, Surroundings, Users

SUBJECT: Final = "--osi"
EXTRA: Final = "osi"

FIRST_BUILDING: Final = 1 << 32
FIRST_LIGHT: Final = 1 << 33
"""Identifiers of buildings and bulbs: above the numbers of all road users."""

LIGHT_SPEED: Final = 299_792_458.0

_KINDS: Final = {
    Body.CAR: "TYPE_MEDIUM_CAR",
    Body.SUV: "TYPE_MEDIUM_CAR",
    Body.VAN: "TYPE_DELIVERY_VAN",
    Body.BUS: "TYPE_BUS",
    Body.TRUCK: "TYPE_HEAVY_TRUCK",
    Body.RAIL: "TYPE_TRAM",
    Body.MOTORCYCLE: "TYPE_MOTORBIKE",
    Body.BICYCLE: "TYPE_BICYCLE",
}
_BULBS: Final = ("COLOR_RED", "COLOR_YELLOW", "COLOR_GREEN")
LIT: Final[Mapping[int, frozenset[str]]] = {
    0: frozenset(),
    1: frozenset(_BULBS[:1]),
    2: frozenset(_BULBS[:2]),
    3: frozenset(_BULBS[1:2]),
    4: frozenset(_BULBS[2:]),
    5: frozenset(_BULBS[2:]),
    6: frozenset(_BULBS[:1]),
}
"""Which bulbs are on, by the codes of `light.state`."""


@dataclass(frozen=True)
class World:
    """What does not change in a run.

    Attributes:
        users: who takes part.
        surroundings: what stands around.
        projection: of the plane, if it is known.
    """

    users: Users
    surroundings: Surroundings
    projection: Projection | None

    @cached_property
    def interface(self) -> tuple[int, ...]:
        """The version of OSI."""
        return tuple(int(part) for part in version("osi-python").split(".")[:3])

    @cached_property
    def _truth(self) -> Any:
        """A GroundTruth of all that stands still."""
        truth = module_for("osi3.osi_groundtruth_pb2", SUBJECT, EXTRA).GroundTruth()
        self.stamp(truth, 0)
        for k, building in enumerate(self.surroundings.buildings):
            _add_building(truth.stationary_object.add(), building, FIRST_BUILDING + k)
        if self.projection is not None:
            truth.proj_string = self.projection.text
            offset = truth.proj_frame_offset.position
            offset.x, offset.y = self.projection.offset
        return truth

    def stamp(self, message: Any, time: int) -> None:
        """Say of which version and time [ns] a message is."""
        said = message.version
        said.version_major, said.version_minor, said.version_patch = self.interface
        message.timestamp.seconds, message.timestamp.nanos = divmod(time, 10**9)

    def truth(self, snapshot: Snapshot, host: int | None) -> Any:
        """The GroundTruth of all road users with a body.

        Args:
            snapshot: where they are.
            host: the number of the host vehicle, if there is one.
        """
        truth = type(self._truth)()
        truth.CopyFrom(self._truth)
        self.stamp(truth, snapshot.time)
        if host is not None:
            truth.host_vehicle_id.value = host
        bodies = snapshot.those(snapshot.is_body)
        for k in range(len(bodies)):
            self._add_user(truth.moving_object.add(), bodies, k)
        self._add_lights(truth, snapshot.time)
        return truth

    def view(self, sensor: Array, points: Array, truth: Any, snapshot: Snapshot) -> Any | None:
        """The SensorView of a lidar; `None` if the vehicle that carries it is not there.

        Args:
            sensor: its record.
            points: records, shape (point,).
            truth: the GroundTruth of that time.
            snapshot: where everybody is.
        """
        number = int(sensor["vehicle"])
        rows = np.flatnonzero(snapshot.ids == number)
        if not len(rows):
            return None
        view = module_for("osi3.osi_sensorview_pb2", SUBJECT, EXTRA).SensorView()
        self.stamp(view, int(sensor["time"]))
        view.sensor_id.value = view.host_vehicle_id.value = number
        view.global_ground_truth.CopyFrom(truth)
        view.global_ground_truth.host_vehicle_id.value = number
        _mount(view.mounting_position, sensor, snapshot, int(rows[0]))
        lidar = view.lidar_sensor_view.add()
        lidar.view_configuration.sensor_id.value = number
        lidar.view_configuration.mounting_position.CopyFrom(view.mounting_position)
        _add_reflections(lidar, points)
        return view

    def _add_user(self, moving: Any, bodies: Snapshot, k: int) -> None:
        number, body = int(bodies.ids[k]), Body(int(bodies.body[k]))
        length, width, height = bodies.size[k].tolist()
        x, y, z = bodies.position[k].tolist()
        moving.id.value = number
        base = moving.base
        base.dimension.length, base.dimension.width, base.dimension.height = length, width, height
        base.position.x, base.position.y, base.position.z = x, y, z + height / 2
        base.orientation.yaw = float(bodies.heading[k])
        base.velocity.x, base.velocity.y = bodies.velocity[k].tolist()
        if body is Body.PEDESTRIAN:
            moving.type = moving.TYPE_PEDESTRIAN
        else:
            moving.type = moving.TYPE_VEHICLE
            moving.vehicle_classification.type = getattr(
                moving.vehicle_classification, _KINDS[body]
            )
            rear = moving.vehicle_attributes.bbcenter_to_rear
            rear.x = rear.y = rear.z = 0.0
        named = self.users.named.get(number)
        if named is not None:
            moving.model_reference = named.type
            source = moving.source_reference.add()
            source.type = "nlosim"
            source.identifier.append(named.name)

    def _add_lights(self, truth: Any, time: int) -> None:
        number = FIRST_LIGHT
        for lights in self.surroundings.lights:
            states = np.asarray(lights.states.at(time)) if len(lights.states) else np.empty(0)
            for (x, y), state in zip(lights.position.tolist(), states.tolist(), strict=False):
                for colour in _BULBS:
                    bulb = truth.traffic_light.add()
                    bulb.id.value = number
                    bulb.base.position.x, bulb.base.position.y = x, y
                    said = bulb.classification
                    said.color = getattr(said, colour)
                    is_on = colour in LIT.get(int(state), frozenset())
                    said.mode = said.MODE_CONSTANT if is_on else said.MODE_OFF
                    number += 1


def _add_building(stationary: Any, building: Building, number: int) -> None:
    low, high = building.ring.min(axis=0), building.ring.max(axis=0)
    middle, size = (low + high) / 2, high - low
    stationary.id.value = number
    base = stationary.base
    base.position.x, base.position.y = middle.tolist()
    base.position.z = building.height / 2
    base.dimension.length, base.dimension.width = size.tolist()
    base.dimension.height = building.height
    for x, y in (building.ring - middle).tolist():
        corner = base.base_polygon.add()
        corner.x, corner.y = x, y
    stationary.classification.type = stationary.classification.TYPE_BUILDING


def _mount(mounting: Any, sensor: Array, snapshot: Snapshot, row: int) -> None:
    """Where a sensor is on its vehicle, from the centre of the box."""
    heading, height = float(snapshot.heading[row]), float(snapshot.size[row, 2])
    apart = np.asarray(sensor["position"] - snapshot.position[row])
    ahead = rotate(apart[:2], np.asarray(-heading))
    mounting.position.x, mounting.position.y = ahead.tolist()
    mounting.position.z = float(apart[2]) - height / 2
    turned = float(sensor["heading"]) - heading
    mounting.orientation.yaw = math.remainder(turned, math.tau)
    mounting.orientation.pitch = float(sensor["pitch"])
    mounting.orientation.roll = float(sensor["roll"])


def _add_reflections(lidar: Any, points: Array) -> None:
    """A ray and its reflection for each point."""
    places = points["position"].astype(np.float64)
    distance = np.linalg.norm(places, axis=1)
    directions = places / np.maximum(distance, 1e-9)[:, None]
    configuration = lidar.view_configuration
    configuration.num_of_pixels = len(points)
    configuration.max_number_of_interactions = 1
    rows: Iterable[tuple[list[float], float, float, int]] = zip(
        directions.tolist(),
        (2.0 * distance / LIGHT_SPEED).tolist(),
        points["intensity"].tolist(),
        points["instance"].tolist(),
        strict=True,
    )
    for (x, y, z), flight, intensity, instance in rows:
        ray = configuration.directions.add()
        ray.x, ray.y, ray.z = x, y, z
        reflection = lidar.reflection.add()
        reflection.time_of_flight = flight
        if intensity > 0.0:
            reflection.signal_strength = 10.0 * math.log10(intensity)
        if instance >= 0:
            reflection.object_id.value = instance
        elif instance <= BUILDING:
            reflection.object_id.value = FIRST_BUILDING + BUILDING - instance
