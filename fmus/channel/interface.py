"""The interface of the channel: 802.11p radios of vehicles among buildings and vehicles."""

from typing import Final

from fmus.common.interface import Interface, Variable
from fmus.records import PACKETS_MIME, RECEPTIONS_MIME

_LARGEST_SCENE: Final = 10_000
"""Vehicles; the table of links grows with the square."""


def _parameter(
    name: str,
    start: float,
    unit: str,
    description: str,
    bounds: tuple[float | None, float | None] = (None, None),
) -> Variable:
    return Variable(
        name=name,
        type="Float64",
        causality="parameter",
        variability="fixed",
        description=description,
        unit=unit,
        start=start,
        minimum=bounds[0],
        maximum=bounds[1],
    )


def _switch(name: str, description: str, *, start: bool) -> Variable:
    return Variable(
        name=name,
        type="Boolean",
        causality="parameter",
        variability="fixed",
        description=description,
        start=start,
    )


def _axis(name: str, description: str, *, start: int = 1, maximum: int | None = None) -> Variable:
    return Variable(
        name=name,
        type="UInt64",
        causality="structuralParameter",
        variability="tunable",
        description=description,
        start=start,
        minimum=0,
        maximum=maximum,
    )


def _vehicle(name: str, unit: str, description: str, *columns: int) -> Variable:
    return Variable(
        name=name,
        type="Float64",
        causality="input",
        variability="discrete",
        description=description,
        unit=unit,
        dimensions=("n_vehicle", *columns),
    )


_AXES: Final = (
    _axis("n_vehicle", "Number of vehicles", maximum=_LARGEST_SCENE),
    _axis("n_building_vertex", "Number of corners of all buildings", start=3),
    _axis("n_building", "Number of buildings"),
)

_RADIO: Final = (
    _parameter("carrier_frequency", 5.9e9, "Hz", "Centre of the channel", (1e8, 1e11)),
    _parameter("transmit_power", 26, "dBm", "Radiated power of every radio", (-100, 100)),
    _parameter("noise_floor", -98, "dBm", "Noise power in the channel", (-200, 0)),
    _parameter(
        "sensitivity", -94, "dBm", "Frames weaker than this are not noticed at all", (-200, 0)
    ),
    _parameter(
        "bitrate",
        6e6,
        "bit/s",
        "Of the payload: 3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6 or 27e6",
        (3e6, 27e6),
    ),
    Variable(
        name="mac_header",
        type="UInt32",
        causality="parameter",
        variability="fixed",
        description="Bytes that MAC and LLC add to a packet: QoS data header 26, LLC/SNAP 8, "
        "FCS 4; Veins: 0",
        start=38,
        minimum=0,
        maximum=1000,
    ),
    _parameter("maximum_range", 2600, "m", "Radios farther away hear nothing", (0, 1e6)),
    _parameter(
        "relay_delay", 2e-4, "s", "From the end of a frame at a relay to its next hop", (0, 1e3)
    ),
    Variable(
        name="seed",
        type="UInt64",
        causality="parameter",
        variability="fixed",
        description="Of the draws that decide receptions",
        start=1,
    ),
)

_PROPAGATION: Final = (
    _parameter("path_loss_exponent", 2, "1", "2 is free space", (0, 10)),
    _parameter("lossless_distance", 0, "m", "No path loss up to this distance; Veins: 1", (0, 1e3)),
    _switch("building_shadowing", "Buildings attenuate", start=True),
    _parameter("wall_loss", 9, "dB", "Loss per wall of a building", (0, 1e3)),
    _parameter("indoor_loss", 0.4, "dB/m", "Loss per metre inside a building", (0, 1e3)),
    _switch(
        "finite_buildings",
        "Links over the roof are free; false (Veins): buildings are infinitely high",
        start=True,
    ),
    _switch("vehicle_shadowing", "Vehicle bodies diffract", start=True),
    _switch(
        "unequipped_shadow",
        "Vehicles without a radio shadow too; false (Veins): only equipped ones",
        start=True,
    ),
    _switch(
        "reciprocal",
        "A knife edge stands in the middle of the body; false (Veins): at the face nearest to the "
        "transmitter, so that the two directions of a link differ",
        start=True,
    ),
    _switch(
        "knife_edge_itu",
        "v = h sqrt(2 / lambda (1 / d1 + 1 / d2)) as in ITU-R P.526; false: without the 2",
        start=True,
    ),
)

_INPUTS: Final = (
    Variable(
        name="vehicle.id",
        type="Int64",
        causality="input",
        variability="discrete",
        description="Number of the vehicle, 0 to 2147483647, ascending",
        dimensions=("n_vehicle",),
    ),
    _vehicle("vehicle.position", "m", "Centre of the body's footprint; z is the ground", 3),
    _vehicle("vehicle.heading", "rad", "Counter-clockwise from the x axis"),
    _vehicle("vehicle.size", "m", "Length, width, height of the body", 3),
    _vehicle("vehicle.antenna_height", "m", "Above the ground, at the body's centre"),
    Variable(
        name="vehicle.equipped",
        type="Boolean",
        causality="input",
        variability="discrete",
        description="Has a radio",
        dimensions=("n_vehicle",),
    ),
    Variable(
        name="building.vertex",
        type="Float64",
        causality="input",
        variability="discrete",
        description="Corners of all buildings, ring by ring, open rings, either sense",
        unit="m",
        dimensions=("n_building_vertex", 2),
    ),
    Variable(
        name="building.index",
        type="Int32",
        causality="input",
        variability="discrete",
        description="The building each corner belongs to, 0 to n_building - 1, ascending",
        dimensions=("n_building_vertex",),
    ),
    Variable(
        name="building.height",
        type="Float64",
        causality="input",
        variability="discrete",
        description="Of the roof above z = 0",
        unit="m",
        dimensions=("n_building",),
    ),
    Variable(
        name="packets",
        type="Binary",
        causality="input",
        variability="discrete",
        description="Packets to be sent; one that is held over several steps is sent once",
        mime_type=PACKETS_MIME,
    ),
)

# No dependencies: a reception takes the time that its frame is on air.
_OUTPUTS: Final = (
    Variable(
        name="receptions",
        type="Binary",
        causality="output",
        variability="discrete",
        description="Frames that ended at their receivers in the last step",
        mime_type=RECEPTIONS_MIME,
    ),
)

INTERFACE: Final = Interface(
    name="channel",
    description="802.11p radios: path loss, building and vehicle shadowing, reception per packet, "
    "relays that store and forward",
    variables=(*_AXES, *_RADIO, *_PROPAGATION, *_INPUTS, *_OUTPUTS),
    sources=(
        "channel.c",
        "parameters.c",
        "scene.c",
        "geometry.c",
        "grid.c",
        "path_loss.c",
        "building_shadowing.c",
        "knife_edge.c",
        "vehicle_shadowing.c",
        "link.c",
        "modulation.c",
        "error_rate.c",
        "random.c",
        "packets.c",
        "transmission.c",
        "receptions.c",
        "state.c",
    ),
    headers=(
        "channel.h",
        "parameters.h",
        "scene.h",
        "geometry.h",
        "grid.h",
        "buffer.h",
        "path_loss.h",
        "building_shadowing.h",
        "knife_edge.h",
        "vehicle_shadowing.h",
        "link.h",
        "modulation.h",
        "error_rate.h",
        "random.h",
        "packets.h",
        "receptions.h",
    ),
)
