"""The interface of the channel: 802.11p radios of vehicles among buildings and vehicles."""

from typing import Final

from fmus.channel.caution import UNNOTICED
from fmus.channel.undriven import (
    NO_BUILDINGS,
    PACKETS,
    PROBE_CARRIERS,
    PROBE_SIZES,
    PROBES,
    VEHICLES,
)
from fmus.messages.records import NO_VEHICLE, PACKETS_MIME, RECEPTIONS_MIME, TRANSMISSIONS_MIME
from fmus.native.interface import (
    Interface,
    Variable,
    choice,
    discrete_input,
    discrete_output,
    length,
    parameter,
    switch,
    when_undriven,
    whole,
)
from fmus.native.scene import building, n_building, n_building_vertex, n_vehicle, vehicle

_LARGEST_SCENE: Final = 10_000
"""Vehicles."""

_AXES: Final = (
    n_vehicle(maximum=_LARGEST_SCENE),
    n_building_vertex(),
    n_building(),
    length("n_probe", 1, 0, 1_000_000, "Number of links to be probed"),
    length(
        "n_antenna_gain", 1, 1, 100_000, "Number of samples of the antenna pattern", tunable=False
    ),
)

_MODEL: Final = choice(
    "model",
    ("nlosim", "veins"),
    "veins: the conventions of Veins 5.3.1; the parameters that say `Veins:` are then ignored and "
    "have the value said there",
)

_RADIO: Final = (
    parameter("carrier_frequency", 5.9e9, 1e8, 1e11, "Centre of the channel", unit="Hz"),
    parameter("transmit_power", 26, -100, 100, "Radiated power of every radio", unit="dBm"),
    parameter("noise_floor", -98, -200, 0, "Noise power in the channel", unit="dBm"),
    parameter("sensitivity", -94, -200, 0, "Frames weaker than this are not noticed", unit="dBm"),
    parameter(
        "antenna.gain",
        0,
        -100,
        100,
        "Of every antenna, at equally spaced azimuths from the heading on, counter-clockwise; "
        "between them linear in dB",
        unit="dB",
        dimensions=("n_antenna_gain",),
    ),
    switch(
        "antenna_in_front",
        "Antennas are above the front bumper; false: above the centre of the body; Veins: true",
        start=False,
    ),
    parameter(
        "antenna_height",
        0,
        0,
        100,
        "Of every antenna above the ground; 0: `vehicle.antenna_height`; Veins: 1.895",
        unit="m",
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
    switch(
        "weak_receptions",
        "Frames below the sensitivity are reported too (outcome U); costs the exact power at every "
        "radio in range",
        start=True,
        caution=UNNOTICED,
    ),
    parameter(
        "interference_margin",
        50,
        0,
        200,
        "Frames that arrive this far below the noise floor do not interfere: 50 dB change the SNIR "
        "by 4e-5 dB each, 20 dB by 0.04 dB, for less computing; none is left out where "
        "weak_receptions tells of all",
        unit="dB",
    ),
    switch(
        "band_edges",
        "The SNIR is the lowest of the centre and both edges, 5 MHz off; false: of the centre; "
        "Veins: true",
        start=True,
    ),
    switch(
        "frame_capture",
        "A receiver turns to a frame that is much stronger than what it hears; Veins: false",
        start=True,
    ),
    parameter(
        "capture_margin",
        10,
        0,
        100,
        "How much stronger than everything else on air, noise included, for a capture",
        unit="dB",
    ),
    whole(
        "seed",
        1,
        None,
        None,
        "Of the draws of receptions, fading and backoff that are still to come",
        kind="UInt64",
        tunable=True,
    ),
    whole(
        "threads",
        0,
        0,
        64,
        "That look for links, without effect on results; 0: up to 4, one per core, where it pays",
        kind="UInt32",
    ),
)

_MEDIUM_ACCESS: Final = (
    switch(
        "medium_access",
        "Radios contend (EDCA); false: packets go on air at their times, as soon as the radio has "
        "ended its last frame",
        start=True,
    ),
    parameter(
        "cca_threshold",
        -65,
        -200,
        0,
        "The medium is busy while this power is on air, noise included",
        unit="dBm",
    ),
    whole(
        "queue_limit",
        0,
        0,
        None,
        "Frames that wait per radio and access category; more are dropped; 0: no limit",
        kind="UInt32",
    ),
    parameter(
        "packet_lifetime",
        0,
        0,
        1e6,
        "Frames that waited longer are dropped instead of sent; 0: they wait for ever",
        unit="s",
    ),
    parameter("busy_window", 0.1, 1e-3, 1e3, "Over which the busy ratio is measured", unit="s"),
)

_PROPAGATION: Final = (
    choice("path_loss", ("exponent", "two_ray", "breakpoint"), "Loss over the distance"),
    parameter(
        "path_loss_exponent", 2, 0, 10, "Of `exponent`, 2 is free space; of `breakpoint`, before it"
    ),
    parameter("permittivity", 1.02, 1, 1e3, "Of `two_ray`: relative, of the ground"),
    parameter("breakpoint_distance", 80, 1e-3, 1e6, "Of `breakpoint`", unit="m"),
    parameter(
        "breakpoint_near_loss", 47.85, 0, 200, "Of `breakpoint`: at 1 m before it", unit="dB"
    ),
    parameter("breakpoint_far_loss", 85.91, 0, 300, "Of `breakpoint`: at and beyond it", unit="dB"),
    parameter("breakpoint_far_exponent", 4, 0, 10, "Of `breakpoint`: beyond it"),
    choice("fading", ("none", "nakagami"), "Fast fading, drawn per frame and receiver"),
    parameter("fading_near_m", 1.5, 0.5, 1e3, "Nakagami's shape up to `fading_distance`"),
    parameter("fading_far_m", 0.75, 0.5, 1e3, "Nakagami's shape beyond `fading_distance`"),
    parameter("fading_distance", 80, 0, 1e6, "In the plane", unit="m"),
    switch(
        "fading_clipped",
        "Fading never amplifies (mean power falls by 1 to 2 dB); Veins: true",
        start=False,
    ),
    parameter(
        "lossless_distance", 0, 0, 1e3, "No path loss up to this distance; Veins: 1", unit="m"
    ),
    switch("building_shadowing", "Buildings attenuate", start=True),
    parameter("wall_loss", 9, 0, 1e3, "Loss per wall of a building", unit="dB"),
    parameter("indoor_loss", 0.4, 0, 1e3, "Loss per metre inside a building", unit="dB/m"),
    switch(
        "finite_buildings",
        "Links over the roof are free; false: buildings are infinitely high; Veins: false",
        start=True,
    ),
    switch("vehicle_shadowing", "Vehicle bodies diffract", start=True),
    switch(
        "unequipped_shadow",
        "Vehicles without a radio shadow too; false: only equipped ones; Veins: false",
        start=True,
    ),
    parameter(
        "shadow_width",
        1,
        0,
        1e3,
        "Bodies of less width do not shadow: persons, riders, poles; 0: all do; Veins: 0",
        unit="m",
    ),
    switch(
        "reciprocal",
        "A knife edge stands in the middle of the body; false: at the face nearest to the "
        "transmitter, so that the two directions of a link differ; Veins: false",
        start=True,
    ),
    switch(
        "knife_edge_itu",
        "v = h sqrt(2 / lambda (1 / d1 + 1 / d2)) as in ITU-R P.526; false: without the 2; "
        "Veins: true",
        start=True,
    ),
)

_INPUTS: Final = when_undriven(
    (
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
    ),
    {"vehicle": VEHICLES, "building": NO_BUILDINGS, "packets": PACKETS},
)

_PROBES: Final = when_undriven(
    (
        discrete_input(
            "probe.transmitter",
            "Float64",
            "Antenna at the one end of a link to be probed",
            unit="m",
            dimensions=("n_probe", 3),
        ),
        discrete_input(
            "probe.receiver",
            "Float64",
            "Antenna at the other end",
            unit="m",
            dimensions=("n_probe", 3),
        ),
        discrete_input(
            "probe.carrier",
            "Int64",
            "Vehicles that carry these antennas and do not shadow them; -1: none",
            dimensions=("n_probe", 2),
            start=NO_VEHICLE,
        ),
        discrete_input(
            "probe.size",
            "UInt32",
            "Of a packet on the link [byte]",
            dimensions=("n_probe",),
            start=200,
        ),
    ),
    {"probe": PROBES, "probe.carrier": PROBE_CARRIERS, "probe.size": PROBE_SIZES},
)

_PROBE_INPUTS: Final = tuple(v.name for v in (*_INPUTS, *_PROBES) if v.name != "packets")


def _probed(name: str, description: str, unit: str = "1") -> Variable:
    return discrete_output(
        f"probe.{name}",
        "Float64",
        description,
        unit=unit,
        dimensions=("n_probe",),
        dependencies=_PROBE_INPUTS,
    )


# Receptions and transmissions have no dependencies: a frame takes its time on air.
_OUTPUTS: Final = (
    discrete_output(
        "receptions",
        "Binary",
        "Frames that ended at their receivers in the last step",
        mime_type=RECEPTIONS_MIME,
    ),
    discrete_output(
        "transmissions",
        "Binary",
        "Frames that went on air, or were given up, in the last step",
        mime_type=TRANSMISSIONS_MIME,
    ),
    discrete_output(
        "busy_ratio",
        "Float64",
        "Channel busy ratio of each vehicle's radio over the last complete window",
        dimensions=("n_vehicle",),
    ),
    _probed("path_loss", "Loss over the distance", "dB"),
    _probed("antenna_gain", "Of both antennas, on headings of their carriers", "dB"),
    _probed("building_loss", "Loss by buildings", "dB"),
    _probed("vehicle_loss", "Loss by vehicle bodies", "dB"),
    _probed("power", "Mean received power", "dBm"),
    _probed("header_success", "Probability that noise alone spares the SIGNAL field"),
    _probed("payload_success", "Probability that noise alone spares the rest of the frame"),
    discrete_output(
        "probe.link",
        "Int32",
        "0 LOS, 1 NLOSv, 2 NLOSb",
        dimensions=("n_probe",),
        dependencies=_PROBE_INPUTS,
    ),
)

_MODULES: Final = (
    "parameters", "scene", "geometry", "area_index", "sort", "path_loss", "antenna",
    "building_shadowing", "knife_edge", "vehicle_shadowing", "pair", "gap", "street_cells",
    "surroundings", "team", "link", "probe", "modulation", "error_rate", "random", "packets",
    "queues", "radios", "access_category", "medium_access", "frames", "fading", "events", "reports",
    "state", "arrivals", "interference", "schedule", "carrier_sense", "transmission", "reception",
    "dispatch",
)  # fmt: skip
"""Each has a header and a source of its name."""

_HEADERS: Final = ("clock", "decibel", "buffer", "threads")
"""They have no source."""

INTERFACE: Final = Interface(
    name="channel",
    description="802.11p radios: path loss, building and vehicle shadowing, reception per packet, "
    "relays that store and forward",
    variables=(
        *_AXES,
        _MODEL,
        *_RADIO,
        *_MEDIUM_ACCESS,
        *_PROPAGATION,
        *_INPUTS,
        *_PROBES,
        *_OUTPUTS,
    ),
    sources=("channel.c", *(f"{module}.c" for module in _MODULES)),
    headers=tuple(f"{header}.h" for header in (*_HEADERS, *_MODULES)),
)
