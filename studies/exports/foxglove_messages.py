"""Messages of Foxglove's schemas: https://docs.foxglove.dev/docs/sdk/schemas.

The world frame is that of the run: x east, y north, z up, in metres.
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from adapters.traffic.bodies import Body
from adapters.traffic.colours import BODY_COLOURS, LIGHT_COLOURS
from fmus.messages.records import POINT
from orchestrator.palette import BLACK, GREY, GROUND, LIGHT, VERMILLION
from orchestrator.signal import Array
from studies.exports.rotation import quaternion
from studies.exports.scene import Snapshot, Surroundings, Users
from studies.exports.triangles import prism, triangulated

WORLD: Final = "world"

_LIGHT_HEIGHT: Final = 4.0
_ROAD_HEIGHT: Final = 0.01
"""Height of roads above the ground [m], so that a viewer's grid is below."""


class Messages:
    """Makes messages.

    Args:
        schemas: the module `foxglove.messages`.
    """

    def __init__(self, schemas: Any) -> None:
        self._schemas = schemas

    def time(self, time: int) -> Any:
        """A time [ns]."""
        seconds, rest = divmod(time, 10**9)
        return self._schemas.Timestamp(sec=seconds, nsec=rest)

    def vehicles(
        self, snapshot: Snapshot, users: Users, driven: frozenset[int], gone: set[int]
    ) -> Any:
        """A SceneUpdate of all road users with a body.

        Args:
            snapshot: where they are.
            users: who they are.
            driven: numbers of driven entities, which have their names beside them.
            gone: numbers of those that are no longer there.
        """
        make, stamp = self._schemas, self.time(snapshot.time)
        entities = []
        rows = zip(
            snapshot.ids.tolist(),
            snapshot.position.tolist(),
            snapshot.heading.tolist(),
            snapshot.size.tolist(),
            snapshot.body.tolist(),
            strict=True,
        )
        for number, (x, y, z), heading, (length, width, height), body in rows:
            name = users.name_of(number)
            texts = []
            if number in driven:
                above = make.Pose(position=make.Vector3(x=x, y=y, z=z + height + 1.0))
                texts = [
                    make.TextPrimitive(
                        pose=above,
                        billboard=True,
                        font_size=1.5,
                        text=name,
                        color=self.colour(BLACK),
                    )
                ]
            pose = make.Pose(
                position=make.Vector3(x=x, y=y, z=z + height / 2), orientation=self.turned(heading)
            )
            cube = make.CubePrimitive(
                pose=pose,
                size=make.Vector3(x=length, y=width, z=height),
                color=self.colour(VERMILLION if number in driven else BODY_COLOURS[Body(body)]),
            )
            type_ = users.named[number].type if number in users.named else ""
            said = {"number": str(number), "name": name, "type": type_}
            entities.append(
                make.SceneEntity(
                    id=str(number),
                    frame_id=WORLD,
                    timestamp=stamp,
                    metadata=[make.KeyValuePair(key=k, value=v) for k, v in said.items() if v],
                    cubes=[cube],
                    texts=texts,
                )
            )
        matching = make.SceneEntityDeletionType.MatchingId
        deletions = [
            make.SceneEntityDeletion(timestamp=stamp, type=matching, id=str(number))
            for number in sorted(gone)
        ]
        return make.SceneUpdate(entities=entities, deletions=deletions)

    def frames(self, snapshot: Snapshot, users: Users) -> Any:
        """FrameTransforms: each road user's frame has its origin in the middle on the ground."""
        make, stamp = self._schemas, self.time(snapshot.time)
        transforms = [
            make.FrameTransform(
                timestamp=stamp,
                parent_frame_id=WORLD,
                child_frame_id=users.name_of(number),
                translation=make.Vector3(x=x, y=y, z=z),
                rotation=self.turned(heading),
            )
            for number, (x, y, z), heading in zip(
                snapshot.ids.tolist(),
                snapshot.position.tolist(),
                snapshot.heading.tolist(),
                strict=True,
            )
        ]
        return make.FrameTransforms(transforms=transforms)

    def surroundings(self, found: Surroundings, time: int) -> Any:
        """A SceneUpdate of buildings and roads."""
        make, stamp = self._schemas, self.time(time)
        roads = [
            self._triangles(
                np.column_stack([ring, np.full(len(ring), _ROAD_HEIGHT)]), triangulated(ring), LIGHT
            )
            for ring in found.roads
        ]
        buildings = [
            self._triangles(*prism(building.ring, building.height), GROUND)
            for building in found.buildings
        ]
        entities = [
            make.SceneEntity(id=name, frame_id=WORLD, timestamp=stamp, triangles=triangles)
            for name, triangles in (("roads", roads), ("buildings", buildings))
            if triangles
        ]
        return make.SceneUpdate(entities=entities)

    def lights(self, position: Array, state: Array, time: int, name: str) -> Any:
        """A SceneUpdate of traffic lights: positions [m], shape (signal, 2), and their states."""
        make, size = self._schemas, 0.8
        spheres = [
            make.SpherePrimitive(
                pose=make.Pose(position=make.Vector3(x=x, y=y, z=_LIGHT_HEIGHT)),
                size=make.Vector3(x=size, y=size, z=size),
                color=self.colour(LIGHT_COLOURS[code] if 0 <= code < len(LIGHT_COLOURS) else GREY),
            )
            for (x, y), code in zip(position.tolist(), state.tolist(), strict=True)
        ]
        entity = make.SceneEntity(
            id=name, frame_id=WORLD, timestamp=self.time(time), spheres=spheres
        )
        return make.SceneUpdate(entities=[entity])

    def cloud(self, sensor: Array, points: Array) -> Any:
        """A PointCloud: a record of a sensor, and its points in its frame, shape (point,)."""
        make = self._schemas
        number = make.PackedElementFieldNumericType
        kinds = {"x": number.Float32, "y": number.Float32, "z": number.Float32}
        kinds |= {"intensity": number.Float32, "instance": number.Int32}
        fields = [
            make.PackedElementField(name=name, offset=4 * k, type=kind)
            for k, (name, kind) in enumerate(kinds.items())
        ]
        x, y, z = sensor["position"].tolist()
        pose = make.Pose(
            position=make.Vector3(x=x, y=y, z=z),
            orientation=self.turned(
                float(sensor["heading"]), float(sensor["pitch"]), float(sensor["roll"])
            ),
        )
        return make.PointCloud(
            timestamp=self.time(int(sensor["time"])),
            frame_id=WORLD,
            pose=pose,
            point_stride=POINT.itemsize,
            fields=fields,
            data=points.tobytes(),
        )

    def turned(self, heading: float, pitch: float = 0.0, roll: float = 0.0) -> Any:
        """A rotation by roll about x, then pitch about y, then heading about z [rad]."""
        x, y, z, w = quaternion(heading, pitch, roll).tolist()
        return self._schemas.Quaternion(x=x, y=y, z=z, w=w)

    def colour(self, code: str, opacity: float = 1.0) -> Any:
        """A colour, `#RRGGBB`."""
        red, green, blue = (int(code[k : k + 2], 16) / 255 for k in (1, 3, 5))
        return self._schemas.Color(r=red, g=green, b=blue, a=opacity)

    def _triangles(self, vertices: Array, indices: Array, code: str) -> Any:
        make = self._schemas
        points: Sequence[Any] = [make.Point3(x=x, y=y, z=z) for x, y, z in vertices.tolist()]
        return make.TriangleListPrimitive(
            points=points, indices=indices.reshape(-1).tolist(), color=self.colour(code)
        )
