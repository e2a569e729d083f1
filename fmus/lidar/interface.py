"""The interface of the lidar FMU; docs/physics-lidar.md describes the model behind it."""

import math
from typing import Final

from fmus.lidar.undriven import UNDRIVEN
from fmus.messages.records import POINTS_MIME
from fmus.native.interface import Interface, discrete_output, parameter, when_undriven, whole
from fmus.native.scene import building, n_building, n_building_vertex, n_vehicle, vehicle

_SIZES: Final = (
    n_vehicle(maximum=1_000_000),
    n_building_vertex(maximum=10_000_000),
    n_building(maximum=1_000_000),
)

_PATTERN: Final = (
    whole(
        "channels",
        64,
        1,
        512,
        "Number of elevations, equally spaced from elevation_top to elevation_bottom",
    ),
    parameter(
        "elevation_top", math.radians(4), -1.5, 1.5, "Elevation of the first channel", unit="rad"
    ),
    parameter(
        "elevation_bottom",
        math.radians(-20),
        -1.5,
        1.5,
        "Elevation of the last channel",
        unit="rad",
    ),
    whole(
        "azimuths",
        1024,
        4,
        8192,
        "Number of directions in one turn, the first straight ahead, then counter-clockwise",
    ),
    parameter("range", 50, 0.1, 1000, "Largest distance of a hit", unit="m"),
)

_MOUNTING: Final = (
    parameter(
        "mount_height",
        0.5,
        0,
        10,
        "Height of the sensor over the roof of the vehicle that carries it",
        unit="m",
    ),
    parameter(
        "pitch",
        0,
        -math.pi / 2,
        math.pi / 2,
        "Tilt of the mounted sensor, nose down positive",
        unit="rad",
    ),
    parameter(
        "roll",
        0,
        -math.pi,
        math.pi,
        "Tilt of the mounted sensor, right side down positive",
        unit="rad",
    ),
)

_NOISE: Final = (
    parameter(
        "range_noise", 0.02, 0, 10, "Standard deviation of the error along the ray", unit="m"
    ),
    parameter("dropout", 0.02, 0, 1, "Probability that a hit is not reported"),
    whole("seed", 0, None, None, "Selects the random numbers of noise and dropout", kind="Int64"),
)

_INPUTS: Final = when_undriven(
    (
        vehicle("id"),
        vehicle("position"),
        vehicle("heading"),
        vehicle("size", start=1),
        vehicle("body"),
        vehicle("lidar"),
        building("vertex"),
        building("index"),
        building("height", start=1),
    ),
    UNDRIVEN,
)

INTERFACE: Final = Interface(
    name="lidar",
    description="Lidar sensors on vehicle roofs: exact ray casting on ground, buildings and bodies",
    variables=(
        *_SIZES,
        *_PATTERN,
        *_MOUNTING,
        *_NOISE,
        *_INPUTS,
        discrete_output(
            "points",
            "Binary",
            "One scan of every sensor, taken at the communication point",
            dependencies=tuple(variable.name for variable in _INPUTS),
            mime_type=POINTS_MIME,
        ),
    ),
    sources=(
        "lidar.c",
        "check.c",
        "scene.c",
        "bodies.c",
        "pattern.c",
        "view.c",
        "outline.c",
        "raster.c",
        "cloud.c",
    ),
    headers=(
        "check.h",
        "scene.h",
        "bodies.h",
        "pattern.h",
        "view.h",
        "outline.h",
        "raster.h",
        "cloud.h",
        "random.h",
        "memory.h",
    ),
)
