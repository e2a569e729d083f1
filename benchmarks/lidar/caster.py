"""The casting of the lidar unit alone: its sources, compiled with `caster.c`, through ctypes."""

import atexit
import ctypes
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from ctypes import POINTER, c_double, c_int32, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from benchmarks.lidar.pattern import Pattern, sensor_position
from benchmarks.lidar.town import Town
from fmus.native.unit import compile_parts, load_unit
from orchestrator.signal import Array

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int32]

_SOURCE: Final = Path(__file__).parent / "caster.c"
_AROUND: Final = frozenset({"lidar.c", "check.c", "cloud.c"})
"""C files of the unit that are no part of the casting."""


class _Pattern(ctypes.Structure):
    _fields_: ClassVar = [
        ("channels", c_uint32),
        ("azimuths", c_uint32),
        *((name, c_double) for name in ("top", "bottom", "pitch", "roll", "reach")),
    ]


class _Vehicles(ctypes.Structure):
    _fields_: ClassVar = [
        ("count", c_size_t),
        *((name, c_void_p) for name in ("id", "position", "heading", "size", "body", "lidar")),
    ]


class _Buildings(ctypes.Structure):
    _fields_: ClassVar = [
        ("vertex_count", c_size_t),
        ("count", c_size_t),
        *((name, c_void_p) for name in ("vertex", "index", "height")),
    ]


class _Viewpoint(ctypes.Structure):
    _fields_: ClassVar = [
        ("position", c_double * 3),
        ("heading", c_double),
        ("vehicle", c_size_t),
    ]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prism:
    """What a scene is made of.

    Attributes:
        ring: corners, counter-clockwise [m], shape (corner, 2).
        bottom, top: heights [m].
        instance: as in the points of the lidar.
    """

    ring: Float
    bottom: float
    top: float
    instance: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hits:
    """What the rays of a scan hit, by azimuth, then channel.

    Attributes:
        distance: [m], infinite for nothing, shape (ray,).
        instance: as in the points of the lidar, 0 for nothing, shape (ray,).
    """

    distance: Float
    instance: Int


class Caster:
    """The unit's scene and one scan after the other; what is passed to C is prepared beforehand."""

    def __init__(self, town: Town, pattern: Pattern) -> None:
        self._library = _library()
        self._caster = c_void_p(self._library.caster_new())
        self._rays = pattern.rays
        self._inputs = town.inputs()
        self._buildings = _buildings(self._inputs[0])
        self._vehicles = [_vehicles(inputs) for inputs in self._inputs]
        self._viewpoints = [
            [_viewpoint(town, scan, vehicle) for vehicle in town.sensors]
            for scan in range(len(self._inputs))
        ]
        p = pattern
        parameters = _Pattern(p.channels, p.azimuths, p.top, p.bottom, p.pitch, p.roll, p.reach)
        self._check(self._library.caster_pattern(self._caster, ctypes.byref(parameters)))

    def close(self) -> None:
        """Give the memory back."""
        self._library.caster_free(self._caster)

    def show(self, scan: int) -> None:
        """Move all vehicles to where they are in a scan."""
        vehicles, buildings = self._vehicles[scan], self._buildings
        self._check(
            self._library.caster_scene(
                self._caster, ctypes.byref(vehicles), ctypes.byref(buildings)
            )
        )

    def cast(self, scan: int, sensor: int) -> None:
        """Trace all rays of one sensor, in the scene that is shown."""
        viewpoint = self._viewpoints[scan][sensor]
        self._check(self._library.caster_cast(self._caster, ctypes.byref(viewpoint)))

    def hits(self) -> Hits:
        """What the last scan hit."""
        distance, instance = np.empty(self._rays), np.empty(self._rays, np.int32)
        self._library.caster_hits(
            self._caster, c_void_p(distance.ctypes.data), c_void_p(instance.ctypes.data)
        )
        return Hits(distance=distance, instance=instance)

    def prisms(self) -> Sequence[Prism]:
        """The prisms of the scene that is shown: buildings first, then vehicles."""
        return [self._prism(k) for k in range(self._library.caster_prisms(self._caster))]

    def _prism(self, number: int) -> Prism:
        count, level, instance = c_size_t(), (c_double * 2)(), c_int32()
        ring = self._library.caster_prism(
            self._caster,
            c_size_t(number),
            ctypes.byref(count),
            level,
            ctypes.byref(instance),
        )
        corners = np.ctypeslib.as_array(ring, (count.value, 2)).copy()
        return Prism(ring=corners, bottom=level[0], top=level[1], instance=instance.value)

    @staticmethod
    def _check(is_short: int) -> None:
        if is_short:
            raise MemoryError("not enough memory for the scene")


@cache
def _library() -> Any:
    """Compiled once per process, with the compiler and the flags of the FMU."""
    folder = Path(tempfile.mkdtemp(prefix="nlosim-caster-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    unit = load_unit("lidar")
    casting = [name for name in unit.interface.sources if name not in _AROUND]
    parts = [*casting, "portable_math.c"]
    library = compile_parts(unit, parts, wrapper=_SOURCE, folder=folder)
    library.caster_new.restype = c_void_p
    library.caster_prisms.restype = c_size_t
    library.caster_prism.restype = POINTER(c_double)
    return library


def _address(array: Array) -> c_void_p:
    return c_void_p(array.ctypes.data)


def _vehicles(inputs: Mapping[str, Array]) -> _Vehicles:
    names = ("id", "position", "heading", "size", "body", "lidar")
    return _Vehicles(
        len(inputs["vehicle.id"]), *(_address(inputs[f"vehicle.{name}"]) for name in names)
    )


def _buildings(inputs: Mapping[str, Array]) -> _Buildings:
    return _Buildings(
        len(inputs["building.vertex"]),
        len(inputs["building.height"]),
        *(_address(inputs[f"building.{name}"]) for name in ("vertex", "index", "height")),
    )


def _viewpoint(town: Town, scan: int, vehicle: int) -> _Viewpoint:
    position = (c_double * 3)(*sensor_position(town, scan, vehicle))
    return _Viewpoint(position, town.heading[scan, vehicle], vehicle)
