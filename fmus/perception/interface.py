"""The interface of the perception FMU: lidar points in; APMs, objects and sharing demand out."""

from typing import Final

from fmus.common.interface import (
    Interface,
    discrete_input,
    discrete_output,
    length,
    parameter,
    switch,
    whole,
)
from fmus.records import APMS_MIME, OBJECTS_MIME, POINTS_MIME

OWN_VIEW: Final = ("points",)
DEMAND: Final = (*OWN_VIEW, "ego.id", "route.vertex")
MATCH: Final = (*DEMAND, "received")

LONGEST: Final = 1 << 20
"""Most entries along an axis."""

STRUCTURE: Final = (
    length("n_route_vertex", 1, 0, LONGEST, "points of the route, fewer than 2: no route"),
    length("n_blind_zone", 32, 1, LONGEST, "most blind zones that are reported", tunable=False),
    length("n_sharer", 8, 1, LONGEST, "most sharers that are reported", tunable=False),
)

MATRIX: Final = (
    whole("rows", 20, 1, 1024, "m, cells of the matrix along the heading"),
    whole("columns", 20, 1, 1024, "n, cells of the matrix across the heading"),
    parameter("cell", 5.0, 0.01, 1000.0, "k, side of a cell", unit="m"),
    parameter("offset", 0.0, -1e4, 1e4, "centre of the matrix ahead of the sensor", unit="m"),
    parameter("floor", -0.5, -1e3, 0.0, "points deeper below the ground are outliers", unit="m"),
    parameter("ceiling", 4.5, 0.0, 1e3, "points higher above the ground are pruned", unit="m"),
    switch("layer", "attach the mobility-and-height layer to the matrices", start=True),
)

OBJECTS: Final = (
    parameter("ground_height", 0.2, 0.0, 10.0, "returns up to this height are ground", unit="m"),
    whole("minimum_points", 5, 1, 1 << 20, "fewest points above the ground that are an object"),
    whole("track_memory", 5, 2, 1000, "scans that a tracked velocity is an average of"),
    parameter("track_timeout", 1.0, 0.0, 1e4, "age at which a lost track is forgotten", unit="s"),
)

BLIND_ZONES: Final = (
    whole("window_smallest", 1, 1, 1024, "side of the smallest filter window in cells"),
    whole("window_largest", 4, 1, 1024, "bound on the side of windows: smallest, twice it, ..."),
    parameter("threshold", 5.0, 0.0, 1e9, "T1, mean index of a window below which it is blind"),
    whole("threshold_exponent", 0, 0, 4, "p: T1 is multiplied by (threshold_distance / d)^p"),
    parameter("threshold_distance", 50.0, 1e-3, 1e5, "distance at which T1 holds", unit="m"),
    parameter("corridor", 25.0, 0.0, 1e5, "reach of the search beside the route", unit="m"),
    parameter("near_field", 6.0, 0.0, 1e5, "the search begins at this distance", unit="m"),
    parameter("horizon", 35.0, 0.0, 1e5, "the search ends at this distance", unit="m"),
    parameter("zone_overlap", 0.0, 0.0, 1.0, "share of a window that larger blind zones may cover"),
)

MATCHING: Final = (
    parameter("maximum_age", 0.5, 0.0, 1e4, "age up to which received APMs are used", unit="s"),
    parameter(
        "benefit_threshold", 1000.0, 0.0, 1e15, "benefit from which sharing pays", unit="m^2"
    ),
    parameter("release_ratio", 0.5, 0.0, 1.0, "a chosen sharer stays above this share of it"),
    parameter("switch_margin", 0.1, 0.0, 1e3, "how much better a sharer must be to overtake one"),
)

INPUTS: Final = (
    discrete_input("points", "Binary", "the scans of all sensors", mime_type=POINTS_MIME),
    discrete_input(
        "received",
        "Binary",
        "APMs that reached the ego vehicle since the last step",
        mime_type=APMS_MIME,
    ),
    discrete_input("ego.id", "Int64", "number of the ego vehicle, -1 if there is none", start=-1),
    discrete_input(
        "route.vertex",
        "Float64",
        "planned route of the ego vehicle, world frame",
        unit="m",
        dimensions=("n_route_vertex", 2),
    ),
)

OUTPUTS: Final = (
    discrete_output(
        "apms",
        "Binary",
        "the APM message of each sensor's vehicle",
        dependencies=OWN_VIEW,
        mime_type=APMS_MIME,
    ),
    discrete_output(
        "objects",
        "Binary",
        "what each sensor detects and tracks",
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
        *MATRIX,
        *OBJECTS,
        *BLIND_ZONES,
        *MATCHING,
        *INPUTS,
        *OUTPUTS,
    ),
    sources=(
        "perception.c",
        "kernel.c",
        "cloud.c",
        "scan.c",
        "tracks.c",
        "objects.c",
        "apm.c",
        "blind_zone.c",
        "overlap.c",
        "match.c",
        "state.c",
    ),
    headers=(
        "perception.h",
        "kernel.h",
        "cloud.h",
        "scan.h",
        "tracks.h",
        "objects.h",
        "apm.h",
        "blind_zone.h",
        "overlap.h",
        "match.h",
    ),
)
