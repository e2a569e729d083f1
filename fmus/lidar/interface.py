"""The interface of the lidar FMU; docs/physics-lidar.md describes the model behind it."""

import math
from typing import Final

from fmus.common.interface import Interface, Variable
from fmus.records import POINTS_MIME

_SIZES: Final = (
    Variable(
        name="n_vehicle",
        type="UInt64",
        causality="structuralParameter",
        variability="tunable",
        description="Number of vehicles",
        start=1,
        minimum=0,
        maximum=1_000_000,
    ),
    Variable(
        name="n_building_vertex",
        type="UInt64",
        causality="structuralParameter",
        variability="tunable",
        description="Number of corners of all buildings",
        start=3,
        minimum=0,
        maximum=10_000_000,
    ),
    Variable(
        name="n_building",
        type="UInt64",
        causality="structuralParameter",
        variability="tunable",
        description="Number of buildings",
        start=1,
        minimum=0,
        maximum=1_000_000,
    ),
)

_PATTERN: Final = (
    Variable(
        name="channels",
        type="Int32",
        causality="parameter",
        variability="fixed",
        description="Number of elevations, equally spaced from elevation_top to elevation_bottom",
        start=64,
        minimum=1,
        maximum=512,
    ),
    Variable(
        name="elevation_top",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="rad",
        description="Elevation of the first channel",
        start=math.radians(4),
        minimum=-1.5,
        maximum=1.5,
    ),
    Variable(
        name="elevation_bottom",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="rad",
        description="Elevation of the last channel",
        start=math.radians(-20),
        minimum=-1.5,
        maximum=1.5,
    ),
    Variable(
        name="azimuths",
        type="Int32",
        causality="parameter",
        variability="fixed",
        description="Number of directions in one turn, the first straight ahead, "
        "then counter-clockwise",
        start=1024,
        minimum=4,
        maximum=8192,
    ),
    Variable(
        name="range",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="m",
        description="Largest distance of a hit",
        start=50,
        minimum=0.1,
        maximum=1000,
    ),
)

_MOUNTING: Final = (
    Variable(
        name="mount_height",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="m",
        description="Height of the sensor over the roof of the vehicle that carries it",
        start=0.5,
        minimum=0,
        maximum=10,
    ),
    Variable(
        name="pitch",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="rad",
        description="Tilt of the mounted sensor, nose down positive",
        minimum=-math.pi / 2,
        maximum=math.pi / 2,
    ),
    Variable(
        name="roll",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="rad",
        description="Tilt of the mounted sensor, right side down positive",
        minimum=-math.pi,
        maximum=math.pi,
    ),
)

_NOISE: Final = (
    Variable(
        name="range_noise",
        type="Float64",
        causality="parameter",
        variability="fixed",
        unit="m",
        description="Standard deviation of the error along the ray",
        start=0.02,
        minimum=0,
        maximum=10,
    ),
    Variable(
        name="dropout",
        type="Float64",
        causality="parameter",
        variability="fixed",
        description="Probability that a hit is not reported",
        start=0.02,
        minimum=0,
        maximum=1,
    ),
    Variable(
        name="seed",
        type="Int64",
        causality="parameter",
        variability="fixed",
        description="Selects the random numbers of noise and dropout",
    ),
)

_VEHICLES: Final = (
    Variable(
        name="vehicle.id",
        type="Int64",
        causality="input",
        variability="discrete",
        dimensions=("n_vehicle",),
        description="Number of the vehicle, ascending",
    ),
    Variable(
        name="vehicle.position",
        type="Float64",
        causality="input",
        variability="discrete",
        unit="m",
        dimensions=("n_vehicle", 3),
        description="Centre of the body's footprint",
    ),
    Variable(
        name="vehicle.heading",
        type="Float64",
        causality="input",
        variability="discrete",
        unit="rad",
        dimensions=("n_vehicle",),
        description="Counter-clockwise from east",
    ),
    Variable(
        name="vehicle.size",
        type="Float64",
        causality="input",
        variability="discrete",
        unit="m",
        dimensions=("n_vehicle", 3),
        description="Length, width and height",
        start=1,
    ),
    Variable(
        name="vehicle.body",
        type="Int32",
        causality="input",
        variability="discrete",
        dimensions=("n_vehicle",),
        description="0 car, 1 SUV or MPV, 2 van, 3 bus, 4 truck",
    ),
    Variable(
        name="vehicle.lidar",
        type="Boolean",
        causality="input",
        variability="discrete",
        dimensions=("n_vehicle",),
        description="Whether the vehicle carries a sensor",
    ),
)

_BUILDINGS: Final = (
    Variable(
        name="building.vertex",
        type="Float64",
        causality="input",
        variability="discrete",
        unit="m",
        dimensions=("n_building_vertex", 2),
        description="Corners of all buildings, ring by ring, in either sense",
    ),
    Variable(
        name="building.index",
        type="Int32",
        causality="input",
        variability="discrete",
        dimensions=("n_building_vertex",),
        description="The building that each corner belongs to, ascending",
    ),
    Variable(
        name="building.height",
        type="Float64",
        causality="input",
        variability="discrete",
        unit="m",
        dimensions=("n_building",),
        description="Height of the walls and of the flat roof",
        start=1,
    ),
)

_INPUTS: Final = _VEHICLES + _BUILDINGS

INTERFACE: Final = Interface(
    name="lidar",
    description="Lidar sensors on vehicle roofs: exact ray casting on ground, buildings and bodies",
    variables=(
        *_SIZES,
        *_PATTERN,
        *_MOUNTING,
        *_NOISE,
        *_INPUTS,
        Variable(
            name="points",
            type="Binary",
            causality="output",
            variability="discrete",
            description="One scan of every sensor, taken at the communication point",
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
        "bins.c",
        "raster.c",
        "cloud.c",
        "random.c",
    ),
    headers=(
        "check.h",
        "scene.h",
        "bodies.h",
        "pattern.h",
        "view.h",
        "bins.h",
        "raster.h",
        "cloud.h",
        "random.h",
        "memory.h",
    ),
)
