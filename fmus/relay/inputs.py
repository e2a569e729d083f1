"""What relay policies read: all that the ego can know, and nothing else."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fmus.messages.pose_errors import PoseErrors
from fmus.messages.records import NO_VEHICLE, OBJECT, unframe
from fmus.physics.plane import Motion
from fmus.relay.measured import MeasuredLinks
from fmus.relay.nodes import Bsms, Node, read_ego
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """What the ego knows at one communication point: its own state, its sensors and its messages.

    If vehicles are wrong about their poses, the ego and its route are where it believes to be.
    There is no field for the simulator's truth. What the signals carry beyond the ego's knowledge
    (the detections of other vehicles' sensors) is left out when they are read.

    Attributes:
        ego: the ego vehicle; its number is `NO_VEHICLE` while it is not there.
        route: centre line of its route, from the vehicle on [m], shape (vertex, 2); empty if it
            is not known.
        building_vertex: its map, corners of the buildings, ring by ring [m], shape (corner, 2);
            while the map stays as it is, the same object.
        building_index: the building of each corner, ascending, int32, shape (corner,).
        objects: what its own lidar sees, `OBJECT` records, shape (object,).
        apms: the APMs that it received, an "APMS" Binary signal; the same object while none came.
        bsms: the BSMs that it received.
        links: received powers that it measured, or that its neighbours announced.
        sensor_data_count: how many packets of sensor data have reached it so far.
        sharers: vehicles whose perception fits its blind zones, the best first, int64, shape
            (sharer,); `NO_VEHICLE` fills unused places.
        is_triggered: whether fusion is triggered.
    """

    ego: Node
    route: Array
    building_vertex: Array
    building_index: Array
    objects: Array
    apms: bytes
    bsms: Bsms
    links: MeasuredLinks
    sensor_data_count: int
    sharers: Array
    is_triggered: bool

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The view of the inputs of a relay policy."""
        ego, route = read_ego(signals), np.asarray(signals["ego.route"], np.float64)
        if error := PoseErrors.read(signals).of(ego.vehicle):
            belief = Motion(about=ego.position, shift=error[0], angle=error[1])
            route = belief.moved(route)
            ego = replace(
                ego,
                position=belief.moved(ego.position),
                heading=ego.heading + belief.angle,
                velocity=belief.turned(ego.velocity),
            )
        objects = unframe("OBJS", bytes(signals["objects"]), OBJECT)
        return cls(
            ego=ego,
            route=route,
            building_vertex=np.asarray(signals["building.vertex"], np.float64),
            building_index=np.asarray(signals["building.index"], np.int32),
            objects=objects.compress(objects["sensor"] == ego.vehicle),
            apms=bytes(signals["received.apms"]),
            bsms=Bsms.read(signals),
            links=MeasuredLinks.read(signals),
            sensor_data_count=int(np.asarray(signals["received.sensor_data.count"], np.int64)),
            sharers=np.asarray(signals["match.sharer"], np.int64),
            is_triggered=bool(signals["match.trigger"]),
        )

    @property
    def wanted_sharer(self) -> int:
        """The best sharer while fusion is triggered and the ego is there, else `NO_VEHICLE`."""
        if not self.is_triggered or self.ego.vehicle == NO_VEHICLE or not len(self.sharers):
            return NO_VEHICLE
        return int(self.sharers[0])
