"""The interface of the perception FMU: lidar points in; APMs, objects and sharing demand out."""

import math
from typing import Final

from fmus.messages.records import APMS_MIME, OBJECTS_MIME, POINTS_MIME
from fmus.native.interface import (
    Interface,
    choice,
    discrete_input,
    discrete_output,
    length,
    parameter,
    switch,
    when_undriven,
    whole,
)
from fmus.native.scene import building, n_building_vertex, n_road_vertex, road
from orchestrator.absence import Need, Undriven

OWN_VIEW: Final = ("points", "building.vertex", "building.index")
DEMAND: Final = (*OWN_VIEW, "ego.id", "route.vertex", "road.vertex", "road.index")
MATCH: Final = (*DEMAND, "received")

LONGEST: Final = 1 << 20
"""Most entries along an axis."""

STRUCTURE: Final = (
    length("n_route_vertex", 1, 0, LONGEST, "points of the route, fewer than 2: no route"),
    n_building_vertex(maximum=LONGEST),
    n_road_vertex(maximum=LONGEST),
    length("n_blind_zone", 32, 1, LONGEST, "most blind zones that are reported", tunable=False),
    length("n_sharer", 8, 1, LONGEST, "most sharers that are reported", tunable=False),
)

SCANS: Final = (
    choice(
        "scans",
        ("all", "ego"),
        "Whose scans are processed: those of all sensors, or the ego vehicle's alone",
    ),
)

MATRIX: Final = (
    whole("rows", 20, 1, 1024, "m, cells of the matrix along the heading"),
    whole("columns", 20, 1, 1024, "n, cells of the matrix across the heading"),
    parameter("cell", 5.0, 0.01, 1000.0, "k, side of a cell", unit="m"),
    parameter("offset", 0.0, -1e4, 1e4, "centre of the matrix ahead of the sensor", unit="m"),
    parameter("floor", -0.5, -1e3, 0.0, "points deeper below the ground are outliers", unit="m"),
    parameter("ceiling", 4.5, 0.0, 1e3, "points higher above the ground are pruned", unit="m"),
    switch("layer", "attach the mobility-and-height layer to the matrices", start=True),
    choice("message", ("plain", "compressed"), "Form of the matrices on the air"),
    choice(
        "index",
        ("points", "seen_area"),
        "What a cell says: how many points are in it, or how much of its ground is seen",
    ),
    whole("index_levels", 15, 1, 255, "a cell whose ground is all seen, with `index` = seen_area"),
)

PATTERN: Final = (
    whole("azimuths", 1024, 4, 8192, "of the sensors, as of the lidar; for seen_area"),
    whole("channels", 64, 1, 512, "of the sensors, as of the lidar; for seen_area"),
    parameter(
        "elevation_top",
        math.radians(4),
        -1.5,
        1.5,
        "of the first channel; for seen_area",
        unit="rad",
    ),
    parameter(
        "elevation_bottom",
        math.radians(-20),
        -1.5,
        1.5,
        "of the last channel; for seen_area",
        unit="rad",
    ),
    parameter("range", 50.0, 0.1, 1000.0, "of the sensors; for seen_area", unit="m"),
)

OBJECTS: Final = (
    choice(
        "segmentation",
        ("clusters", "labels"),
        "How points are told apart: by geometry, or by the simulator's labels (an ideal detector)",
    ),
    choice(
        "boxes",
        ("fitted", "along_axes"),
        "Boxes of objects: turned as the faces of the bodies are, or along the world's axes",
    ),
    parameter("blanking", 1.0, 0.0, 1e3, "returns nearer than this are the own body", unit="m"),
    parameter("ground_height", 0.2, 0.0, 10.0, "returns up to this height are ground", unit="m"),
    parameter(
        "map_margin", 0.5, 0.0, 1e3, "returns this near to a building are part of it", unit="m"
    ),
    parameter("azimuth_gap", 0.75, 0.0, 30.0, "angle between adjacent directions", unit="deg"),
    parameter("depth_gap", 0.5, 0.0, 1e3, "step within one surface along the beam", unit="m"),
    parameter("reach", 6.0, 0.0, 1e3, "step along a body that is seen from its end", unit="m"),
    parameter("roof_gap", 3.0, 0.0, 1e3, "step to a surface that is seen over another", unit="m"),
    parameter("vehicle_length", 18.75, 0.1, 1e3, "of the longest vehicle", unit="m"),
    parameter("vehicle_width", 2.6, 0.1, 1e3, "of the widest vehicle", unit="m"),
    parameter("vehicle_height", 4.3, 0.1, 1e3, "of the highest vehicle", unit="m"),
    parameter("car_length", 5.5, 0.1, 1e3, "of the longest low vehicle", unit="m"),
    parameter("car_width", 2.1, 0.1, 1e3, "of the widest low vehicle", unit="m"),
    parameter("car_height", 2.0, 0.0, 1e3, "up to which a vehicle is low", unit="m"),
    whole("minimum_points", 5, 1, 1 << 20, "fewest points above the ground that are an object"),
    parameter("gate", 2.0, 0.0, 1e3, "a body is this near to where it was predicted", unit="m"),
    parameter("fastest", 40.0, 0.0, 1e3, "speed that a new track may have", unit="m/s"),
    whole("track_memory", 5, 2, 1000, "scans that a tracked velocity is an average of"),
    parameter("track_timeout", 1.0, 0.0, 1e4, "age at which a lost track is forgotten", unit="s"),
)

BLIND_ZONES: Final = (
    whole("window_smallest", 1, 1, 1024, "side of the smallest filter window in cells"),
    whole("window_largest", 4, 1, 1024, "bound on the side of windows: smallest, twice it, ..."),
    parameter("threshold", 5.0, 0.0, 1e9, "T1, mean index of a window below which it is blind"),
    parameter(
        "seen_threshold", 0.5, 0.0, 1.0, "T1 with `index` = seen_area: share of the ground seen"
    ),
    whole("threshold_exponent", 0, 0, 4, "p: T1 is multiplied by (threshold_distance / d)^p"),
    parameter("threshold_distance", 50.0, 1e-3, 1e5, "distance at which T1 holds", unit="m"),
    parameter("corridor", 25.0, 0.0, 1e5, "reach of the search beside the route", unit="m"),
    parameter("near_field", 6.0, 0.0, 1e5, "the search begins at this distance", unit="m"),
    parameter("horizon", 35.0, 0.0, 1e5, "the search ends at this distance", unit="m"),
    parameter(
        "region_resolution",
        0.5,
        1e-3,
        1e5,
        "largest side of the parts of a cell (100 a side at most) that are searched or not; "
        "from `cell` on, its centre decides",
        unit="m",
    ),
    parameter("region_share", 0.2, 0.0, 1.0, "least share of a window that is to be searched"),
    parameter("zone_overlap", 0.0, 0.0, 1.0, "share of a window that larger blind zones may cover"),
)

MATCHING: Final = (
    parameter("maximum_age", 0.5, 0.0, 1e4, "age up to which received APMs are used", unit="s"),
    parameter("hold", 0.0, 0.0, 1e4, "a sharer stays one for so long after it last was", unit="s"),
    parameter(
        "maximum_offset",
        200.0,
        0.0,
        1e15,
        "a received APM centred farther from its source contradicts itself",
        unit="m",
    ),
    switch(
        "region_benefit",
        "count only what is searched of a blind zone, not all of its square",
        start=True,
    ),
    whole("index_limit", 0, 0, None, "a higher index counts as this one; 0: no limit"),
    parameter(
        "benefit_threshold", 1000.0, 0.0, 1e15, "benefit from which sharing pays", unit="m^2"
    ),
    parameter(
        "seen_benefit_threshold",
        15.0,
        0.0,
        1e15,
        "benefit from which sharing pays with `index` = seen_area",
        unit="m^2",
    ),
    parameter("release_ratio", 0.5, 0.0, 1.0, "a chosen sharer stays above this share of it"),
    parameter("switch_margin", 0.1, 0.0, 1e3, "how much better a sharer must be to overtake one"),
)

INPUTS: Final = when_undriven(
    (
        discrete_input("points", "Binary", "the scans of all sensors", mime_type=POINTS_MIME),
        discrete_input(
            "received",
            "Binary",
            "APMs that reached the ego vehicle since the last step",
            mime_type=APMS_MIME,
        ),
        building("vertex"),
        building("index"),
        discrete_input(
            "ego.id", "Int64", "number of the ego vehicle, -1 if there is none", start=-1
        ),
        discrete_input(
            "route.vertex",
            "Float64",
            "planned route of the ego vehicle, world frame",
            unit="m",
            dimensions=("n_route_vertex", 2),
        ),
        road("vertex"),
        road("index"),
    ),
    {
        "points": Undriven("no vehicle scans anything, and nothing is detected"),
        "received": Undriven(
            "no APM of others is known, so that nobody's data ever pay",
            Need.NEVER,
            frozenset({"ego.id"}),
        ),
        "building": Undriven("there is no map, and walls are objects", Need.IF_OFFERED),
        "ego.id": Undriven(
            "there is no ego: nobody looks for blind zones and sharers",
            Need.IF_OFFERED,
            frozenset({"received", "route.vertex"}),
        ),
        "route.vertex": Undriven(
            "blind zones are looked for all around the ego, not beside its route", Need.IF_OFFERED
        ),
        "road": Undriven("the road is everywhere", Need.IF_OFFERED),
    },
)

OUTPUTS: Final = (
    discrete_output(
        "apms",
        "Binary",
        "the APM message of each vehicle whose scan is processed",
        dependencies=OWN_VIEW,
        mime_type=APMS_MIME,
    ),
    discrete_output(
        "objects",
        "Binary",
        "what each sensor whose scan is processed detects and tracks",
        dependencies=OWN_VIEW,
        mime_type=OBJECTS_MIME,
    ),
    discrete_output(
        "blind_zone.center",
        "Float64",
        "centres of the ego vehicle's blind zones, world frame",
        unit="m",
        dimensions=("n_blind_zone", 2),
        dependencies=DEMAND,
    ),
    discrete_output(
        "blind_zone.range",
        "Float64",
        "half the side of each, 0 in unused entries",
        unit="m",
        dimensions=("n_blind_zone",),
        dependencies=DEMAND,
    ),
    discrete_output(
        "match.sharer",
        "Int64",
        "vehicles whose data pays, best first; -1 in unused entries",
        dimensions=("n_sharer",),
        start=-1,
        dependencies=MATCH,
    ),
    discrete_output(
        "match.benefit",
        "Float64",
        "sum of index times overlapping area of each",
        unit="m^2",
        dimensions=("n_sharer",),
        dependencies=MATCH,
    ),
    discrete_output(
        "match.trigger",
        "Boolean",
        "whether any sharer's data pays",
        dependencies=MATCH,
    ),
)

INTERFACE: Final = Interface(
    name="perception",
    description="Abstract perception matrix matching: lidar points to APMs, objects, "
    "blind zones and sharers",
    variables=(
        *STRUCTURE,
        *SCANS,
        *MATRIX,
        *PATTERN,
        *OBJECTS,
        *BLIND_ZONES,
        *MATCHING,
        *INPUTS,
        *OUTPUTS,
    ),
    sources=(
        "perception.c",
        "settings.c",
        "kernel.c",
        "cloud.c",
        "tilt.c",
        "map.c",
        "patches.c",
        "neighbours.c",
        "plausible.c",
        "segments.c",
        "scan.c",
        "boxes.c",
        "seen.c",
        "motion.c",
        "tracks.c",
        "objects.c",
        "compression.c",
        "range_coder.c",
        "seen_compression.c",
        "apm.c",
        "region.c",
        "blind_zone.c",
        "demand.c",
        "overlap.c",
        "match.c",
        "state.c",
    ),
    headers=(
        "state.h",
        "settings.h",
        "kernel.h",
        "cloud.h",
        "tilt.h",
        "map.h",
        "patches.h",
        "search.h",
        "plausible.h",
        "neighbours.h",
        "segments.h",
        "scan.h",
        "boxes.h",
        "seen.h",
        "tracks.h",
        "motion.h",
        "objects.h",
        "compression.h",
        "range_coder.h",
        "seen_compression.h",
        "apm.h",
        "region.h",
        "blind_zone.h",
        "demand.h",
        "overlap.h",
        "match.h",
    ),
)
