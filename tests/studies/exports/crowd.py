"""A recording under names that no component of ours has, and nets with projections."""

import json
from typing import Final

import numpy as np

from adapters.traffic.bodies import Body
from orchestrator.signal import Array, Variability
from tests.recordings import output

CROWD: Final = {
    "who.id": output("body", dtype=np.int64),
    "who.position": output("body", 3, unit="m"),
    "who.heading": output("body", unit="rad"),
    "who.velocity": output("body", 2, unit="m/s"),
    "who.size": output("body", 3, unit="m"),
    "who.body": output("body", dtype=np.int32),
    "ego.id": output(dtype=np.int64),
    "ego.position": output(2, unit="m"),
    "lamp.position": output("lamp", 2, unit="m", variability=Variability.FIXED),
    "lamp.state": output("lamp", dtype=np.int32),
    "entered": output(dtype=None, mime_type="application/json; content=entered; events"),
}
"""Road users under names that no component of ours has."""


def crowd(k: int) -> dict[str, Array | bytes]:
    """A truck that turns, a car of the same type in another size, a person, a roadside unit."""
    heading = np.array([0.3 * k, np.pi, -np.pi / 2, 0.0])
    position = np.array([[3.0 * k, 1.5, 0.0], [9.0, -k, 0.0], [0.0, 5.0 - k, 0.0], [1.0, 1.0, 0.0]])
    entered = [[7, 'tall "one"', "lorry"], [8, "b", "lorry"], [9, "walker", "person"]]
    return {
        "who.id": np.array([7, 8, 9, 1_000_000]),
        "who.position": position,
        "who.heading": heading,
        "who.velocity": np.array([[3.0, 4.0], [0.0, -1.0], [0.0, -1.0], [0.0, 0.0]]),
        "who.size": np.array([[8, 2.5, 4], [6, 2.4, 3], [0.3, 0.5, 1.7], [0.001] * 3]),
        "who.body": np.array([Body.TRUCK, Body.TRUCK, Body.PEDESTRIAN, Body.CAR], np.int32),
        "ego.id": np.array(-1 if k == 0 else 7),
        "ego.position": position[0, :2],
        "lamp.position": np.array([[20.0, 5.0], [25.0, 5.0]]),
        "lamp.state": np.array([1, 5 - k], np.int32),
        "entered": json.dumps(entered if k == 0 else []).encode(),
    }


NET: Final = """\
<net version="1.20">
    <location netOffset="{offset}" convBoundary="0.00,0.00,900.00,700.00"
              origBoundary="8.40,49.00,8.41,49.01" projParameter="{projection}"/>
    <edge id="a" from="i" to="j" priority="1"><lane id="a_0" index="0" speed="13.89" length="900"
        shape="0.00,0.00 900.00,0.00"/></edge>
    <junction id="i" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-3"/>
    <junction id="j" type="dead_end" x="900" y="0" incLanes="a_0" intLanes="" shape="900,-3 900,0"/>
</net>
"""
UTM: Final = "+proj=utm +zone={zone} +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
