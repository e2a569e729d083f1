"""The interface of the channel: 802.11p radios of vehicles among buildings and vehicles."""

from typing import Final

from fmus.common.interface import (
    Interface,
    discrete_input,
    discrete_output,
    parameter,
    switch,
    whole,
)
from fmus.common.scene import building, n_building, n_building_vertex, n_vehicle, vehicle
from fmus.records import PACKETS_MIME, RECEPTIONS_MIME

_LARGEST_SCENE: Final = 10_000
"""Vehicles; the table of links grows with the square."""

_AXES: Final = (n_vehicle(maximum=_LARGEST_SCENE), n_building_vertex(), n_building())

_RADIO: Final = (
    parameter("carrier_frequency", 5.9e9, 1e8, 1e11, "Centre of the channel", unit="Hz"),
    parameter("transmit_power", 26, -100, 100, "Radiated power of every radio", unit="dBm"),
    parameter("noise_floor", -98, -200, 0, "Noise power in the channel", unit="dBm"),
    parameter(
        "sensitivity", -94, -200, 0, "Frames weaker than this are not noticed at all", unit="dBm"
    ),
    parameter(
        "bitrate",
        6e6,
        3e6,
        27e6,
        "Of the payload: 3e6, 4.5e6, 6e6, 9e6, 12e6, 18e6, 24e6 or 27e6",
        unit="bit/s",
    ),
    whole(
        "mac_header",
        38,
        0,
        1000,
        "Bytes that MAC and LLC add to a packet: QoS data header 26, LLC/SNAP 8, FCS 4; Veins: 0",
        kind="UInt32",
    ),
    parameter("maximum_range", 2600, 0, 1e6, "Radios farther away hear nothing", unit="m"),
    parameter(
        "relay_delay", 2e-4, 0, 1e3, "From the end of a frame at a relay to its next hop", unit="s"
    ),
    whole("seed", 1, None, None, "Of the draws that decide receptions", kind="UInt64"),
)

_PROPAGATION: Final = (
    parameter("path_loss_exponent", 2, 0, 10, "2 is free space"),
    parameter(
        "lossless_distance", 0, 0, 1e3, "No path loss up to this distance; Veins: 1", unit="m"
    ),
    switch("building_shadowing", "Buildings attenuate", start=True),
    parameter("wall_loss", 9, 0, 1e3, "Loss per wall of a building", unit="dB"),
    parameter("indoor_loss", 0.4, 0, 1e3, "Loss per metre inside a building", unit="dB/m"),
    switch(
        "finite_buildings",
        "Links over the roof are free; false (Veins): buildings are infinitely high",
        start=True,
    ),
    switch("vehicle_shadowing", "Vehicle bodies diffract", start=True),
    switch(
        "unequipped_shadow",
        "Vehicles without a radio shadow too; false (Veins): only equipped ones",
        start=True,
    ),
    switch(
        "reciprocal",
        "A knife edge stands in the middle of the body; false (Veins): at the face nearest to the "
        "transmitter, so that the two directions of a link differ",
        start=True,
    ),
    switch(
        "knife_edge_itu",
        "v = h sqrt(2 / lambda (1 / d1 + 1 / d2)) as in ITU-R P.526; false: without the 2",
        start=True,
    ),
)

_INPUTS: Final = (
    vehicle("id"),
    vehicle("position"),
    vehicle("heading"),
    vehicle("size"),
    vehicle("antenna_height"),
    vehicle("equipped"),
    building("vertex"),
    building("index"),
    building("height"),
    discrete_input(
        "packets",
        "Binary",
        "Packets to be sent; one that is held over several steps is sent once",
        mime_type=PACKETS_MIME,
    ),
)

# No dependencies: a reception takes the time that its frame is on air.
_OUTPUTS: Final = (
    discrete_output(
        "receptions",
        "Binary",
        "Frames that ended at their receivers in the last step",
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
