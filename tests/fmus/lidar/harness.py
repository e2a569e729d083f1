"""Calls the lidar FMU through its FMI functions, with nothing in between."""

import ctypes
import zipfile
from collections.abc import Callable, Sequence
from ctypes import byref, c_bool, c_char_p, c_double, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from fmus.common.build import build_fmu, load_unit
from fmus.common.targets import host_platform, select_targets
from fmus.records import POINT, SENSOR, unframe
from orchestrator.signal import Array

CAR, SUV, VAN, BUS, TRUCK = range(5)
NO_NOISE: Final = {"range_noise": 0.0, "dropout": 0.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """One vehicle; every member is an input of the FMU."""

    id: int
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading: float = 0.0
    size: tuple[float, float, float] = (4.5, 1.8, 1.5)
    body: int = CAR
    lidar: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """One building."""

    ring: tuple[tuple[float, float], ...]
    height: float = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """All inputs of the FMU."""

    vehicles: Sequence[Vehicle] = ()
    buildings: Sequence[Building] = ()

    def inputs(self) -> dict[str, Array]:
        """The values of the input variables, by name."""
        cars, houses = self.vehicles, self.buildings
        corners = [corner for house in houses for corner in house.ring]
        owners = [k for k, house in enumerate(houses) for _ in house.ring]
        return {
            "vehicle.id": np.array([v.id for v in cars], np.int64),
            "vehicle.position": np.array([v.position for v in cars], float).reshape(-1, 3),
            "vehicle.heading": np.array([v.heading for v in cars], float),
            "vehicle.size": np.array([v.size for v in cars], float).reshape(-1, 3),
            "vehicle.body": np.array([v.body for v in cars], np.int32),
            "vehicle.lidar": np.array([v.lidar for v in cars], np.bool_),
            "building.vertex": np.array(corners, float).reshape(-1, 2),
            "building.index": np.array(owners, np.int32),
            "building.height": np.array([house.height for house in houses], float),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Cloud:
    """What one sensor saw."""

    sensor: Array  # SENSOR, shape ()
    points: Array  # POINT, shape (points,)

    @property
    def instances(self) -> set[int]:
        """Everything that was hit."""
        return set(map(int, self.points["instance"]))

    @property
    def distance(self) -> Array:
        """Of each point from the sensor [m], shape (points,)."""
        position: Array = self.points["position"].astype(float)
        return np.asarray(np.linalg.norm(position, axis=1))

    def on(self, instance: int) -> Array:
        """The points on one instance."""
        chosen: Array = self.points[self.points["instance"] == instance]
        return chosen


def clouds(data: bytes) -> dict[int, Cloud]:
    """The clouds in a `points` signal, by vehicle; asserts that the signal is complete."""
    sensors = unframe("LPTS", data, SENSOR)
    points = np.frombuffer(data, POINT, -1, 16 + sensors.nbytes)
    assert sensors["count"].sum() == len(points)
    assert (np.cumsum(sensors["count"]) - sensors["count"] == sensors["first"]).all()
    return {
        int(s["vehicle"]): Cloud(sensor=s, points=points[s["first"] : s["first"] + s["count"]])
        for s in sensors
    }


@dataclass(slots=True)
class Library:
    """The binary of an FMU and what its modelDescription.xml says."""

    binary: ctypes.CDLL
    token: bytes
    variables: dict[str, tuple[int, str]] = field(default_factory=dict)  # reference, type

    @classmethod
    def build(cls, folder: Path) -> "Library":
        """Build the lidar FMU for this machine and load it."""
        unit = load_unit("lidar")
        archive = build_fmu(unit, folder, targets=select_targets(["host"])).path
        with zipfile.ZipFile(archive) as file:
            file.extractall(folder)
        (path,) = (folder / "binaries" / host_platform()).iterdir()
        root = ET.parse(folder / "modelDescription.xml").getroot()  # noqa: S314 - our own file
        found = root.find("ModelVariables")
        assert found is not None
        library = cls(ctypes.CDLL(str(path)), root.attrib["instantiationToken"].encode())
        for v in found:
            library.variables[v.attrib["name"]] = (int(v.attrib["valueReference"]), v.tag)
        library.binary.fmi3InstantiateCoSimulation.restype = c_void_p
        return library


_LOG = ctypes.CFUNCTYPE(None, c_void_p, ctypes.c_int, c_char_p, c_char_p)
_DTYPES: Final = {
    "Float64": np.float64,
    "Int32": np.int32,
    "Int64": np.int64,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
}


class Refused(Exception):  # noqa: N818 - what the FMU did
    """The FMU returned an error; the message is what it logged."""


class Lidar:
    """One instance, in initialisation mode; without a scene its inputs have start values."""

    def __init__(self, library: Library, scene: Scene | None, **parameters: float) -> None:
        self.library = library
        self.messages: list[str] = []
        self._log: Any = _LOG(lambda _, __, ___, text: self.messages.append(text.decode()))
        token = library.token
        self._instance = c_void_p(
            library.binary.fmi3InstantiateCoSimulation(
                b"lidar", token, None, False, False, False, False, None, c_size_t(0), None,
                self._log, None,
            )
        )  # fmt: skip
        assert self._instance.value is not None, self.messages
        for name, value in parameters.items():
            self.set(name, np.array(value))
        if scene is not None:
            self.resize(scene.inputs())
        self.call("EnterInitializationMode", False, c_double(), c_double(), False, c_double())
        if scene is not None:
            self.set_inputs(scene.inputs())

    def call(self, name: str, *arguments: object) -> None:
        """Call an FMI function; raise `Refused` if it does not return OK."""
        self.messages.clear()
        status = getattr(self.library.binary, f"fmi3{name}")(self._instance, *arguments)
        if status != 0:
            raise Refused(" ".join(self.messages))

    def set(self, name: str, value: Array) -> None:
        """Set one numeric variable."""
        reference, kind = self.library.variables[name]
        data: Array = np.ascontiguousarray(value, _DTYPES[kind])
        pointer = data.ctypes.data_as(c_void_p)
        self.call(f"Set{kind}", byref(c_uint32(reference)), c_size_t(1), pointer,
                  c_size_t(data.size))  # fmt: skip

    def resize(self, inputs: dict[str, Array]) -> None:
        """Size the arrays for `inputs`."""
        self.call("EnterConfigurationMode")
        self.set("n_vehicle", np.array(len(inputs["vehicle.id"])))
        self.set("n_building", np.array(len(inputs["building.height"])))
        self.set("n_building_vertex", np.array(len(inputs["building.index"])))
        self.call("ExitConfigurationMode")

    def set_inputs(self, inputs: dict[str, Array]) -> None:
        """Set every input."""
        for name, value in inputs.items():
            self.set(name, value)

    def start(self) -> "Lidar":
        """Leave initialisation mode."""
        self.call("ExitInitializationMode")
        return self

    def step(self, t: float, h: float) -> None:
        """Advance from t to t + h."""
        flags = [byref(c_bool()) for _ in range(3)]
        self.call("DoStep", c_double(t), c_double(h), True, *flags, byref(c_double()))

    def points(self) -> bytes:
        """The output."""
        reference, _ = self.library.variables["points"]
        size, data = c_size_t(), c_void_p()
        self.call("GetBinary", byref(c_uint32(reference)), c_size_t(1), byref(size),
                  byref(data), c_size_t(1))  # fmt: skip
        return ctypes.string_at(data, size.value) if size.value else b""

    def save(self) -> c_void_p:
        """A copy of the state."""
        state = c_void_p()
        self.call("GetFMUState", byref(state))
        return state

    def restore(self, state: c_void_p) -> None:
        """Return to a saved state."""
        self.call("SetFMUState", state)

    def free(self, state: c_void_p | None = None) -> None:
        """Free a state, or without argument the instance."""
        if state is not None:
            self.call("FreeFMUState", byref(state))
            return
        self.library.binary.fmi3FreeInstance(self._instance)


Scan = Callable[..., dict[int, Cloud]]


def scanner(library: Library) -> Scan:
    """A function (scene, **parameters) that scans once at t = 0."""

    def scan(scene: Scene, **parameters: float) -> dict[int, Cloud]:
        lidar = Lidar(library, scene, **parameters)
        try:
            return clouds(lidar.start().points())
        finally:
            lidar.free()

    return scan


def rectangle(x: float, y: float, length: float, width: float) -> tuple[tuple[float, float], ...]:
    """Corners of an upright rectangle around (x, y), counter-clockwise [m]."""
    a, b = length / 2, width / 2
    return ((x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b))
