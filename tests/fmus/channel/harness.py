"""Calls the channel FMU through its FMI functions, with nothing in between."""

import ctypes
import itertools
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from ctypes import byref, c_bool, c_char_p, c_double, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from fmus.common.build import build_fmu, load_unit
from fmus.common.targets import host_platform, select_targets
from fmus.records import NO_VEHICLE, OUTCOMES, PACKET, RECEPTION, frame, unframe
from orchestrator.signal import Array

MS: Final = 1_000_000
NO_OBSTACLES: Final = {"vehicle_shadowing": False, "building_shadowing": False}
VOICE: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """One vehicle; every member is an input of the FMU."""

    id: int
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading: float = 0.0
    size: tuple[float, float, float] = (4.5, 1.8, 1.5)
    antenna_height: float = 1.55
    equipped: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """One building."""

    ring: Sequence[tuple[float, float]]
    height: float = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """All inputs of the FMU but the packets."""

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
            "vehicle.antenna_height": np.array([v.antenna_height for v in cars], float),
            "vehicle.equipped": np.array([v.equipped for v in cars], np.bool_),
            "building.vertex": np.array(corners, float).reshape(-1, 2),
            "building.index": np.array(owners, np.int32),
            "building.height": np.array([house.height for house in houses], float),
        }


def packet(
    number: int,
    source: int,
    *,
    time: int = 0,
    to: int = NO_VEHICLE,
    via: Sequence[int] = (),
    size: int = 200,
) -> Array:
    """One PACKET record."""
    route = (*via, NO_VEHICLE, NO_VEHICLE)[:2]
    return np.array((number, time, source, to, route, size, VOICE, 0, 0), PACKET)


def packets(records: Iterable[Array]) -> bytes:
    """The `packets` signal with these records."""
    return frame("PKTS", np.array(list(records), PACKET))


_LOG = ctypes.CFUNCTYPE(None, c_void_p, ctypes.c_int, c_char_p, c_char_p)
_DTYPES: Final = {
    "Float64": np.float64,
    "Int32": np.int32,
    "Int64": np.int64,
    "UInt32": np.uint32,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
}


@dataclass(slots=True)
class Library:
    """The binary of the FMU and what its modelDescription.xml says."""

    binary: ctypes.CDLL
    token: bytes
    variables: dict[str, tuple[int, str]] = field(default_factory=dict)  # reference, type

    @classmethod
    def build(cls, folder: Path) -> "Library":
        """Build the channel FMU for this machine and load it."""
        archive = build_fmu(load_unit("channel"), folder, targets=select_targets(["host"])).path
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


class Refused(Exception):  # noqa: N818 - what the FMU did
    """The FMU returned an error; the message is what it logged."""


class Channel:
    """One instance, ready to step; freed by `with`."""

    def __init__(self, library: Library, scene: Scene, **parameters: float) -> None:
        self.library = library
        self.messages: list[str] = []
        self._log: Any = _LOG(lambda _, __, ___, text: self.messages.append(text.decode()))
        self._instance = c_void_p(
            library.binary.fmi3InstantiateCoSimulation(
                b"channel", library.token, None, False, True, False, False, None, c_size_t(0),
                None, self._log, None,
            )
        )  # fmt: skip
        assert self._instance.value is not None, self.messages
        for name, value in parameters.items():
            self.set(name, np.array(value))
        self.call("EnterConfigurationMode")
        self._resize(scene.inputs())
        self.call("ExitConfigurationMode")
        self.call("EnterInitializationMode", False, c_double(), c_double(), False, c_double())
        self._set_inputs(scene.inputs())
        self.call("ExitInitializationMode")

    def __enter__(self) -> "Channel":
        return self

    def __exit__(self, *_: object) -> None:
        self.library.binary.fmi3FreeInstance(self._instance)

    def call(self, name: str, *arguments: object) -> None:
        """Call an FMI function; raise `Refused` if it does not return OK."""
        first = len(self.messages)
        status = getattr(self.library.binary, f"fmi3{name}")(self._instance, *arguments)
        if status != 0:
            raise Refused(" ".join(self.messages[first:]))

    def set(self, name: str, value: Array) -> None:
        """Set one numeric variable."""
        reference, kind = self.library.variables[name]
        data: Array = np.ascontiguousarray(value, _DTYPES[kind])
        pointer = data.ctypes.data_as(c_void_p)
        self.call(f"Set{kind}", byref(c_uint32(reference)), c_size_t(1), pointer,
                  c_size_t(data.size))  # fmt: skip

    def _resize(self, inputs: Mapping[str, Array]) -> None:
        self.set("n_vehicle", np.array(len(inputs["vehicle.id"])))
        self.set("n_building", np.array(len(inputs["building.height"])))
        self.set("n_building_vertex", np.array(len(inputs["building.index"])))

    def _set_inputs(self, inputs: Mapping[str, Array]) -> None:
        for name, value in inputs.items():
            self.set(name, value)

    def change(self, scene: Scene) -> None:
        """Another scene, with another number of vehicles perhaps."""
        self.call("EnterConfigurationMode")
        self._resize(scene.inputs())
        self.call("ExitConfigurationMode")
        self._set_inputs(scene.inputs())

    def send(self, data: bytes) -> None:
        """Set the packets."""
        reference, _ = self.library.variables["packets"]
        buffer = ctypes.create_string_buffer(data, len(data))
        self.call("SetBinary", byref(c_uint32(reference)), c_size_t(1),
                  byref(c_size_t(len(data))), byref(c_void_p(ctypes.addressof(buffer))),
                  c_size_t(1))  # fmt: skip

    def step(self, t: float, h: float, records: Iterable[Array] | None = None) -> Array:
        """Advance from t to t + h; the receptions. Without records the input stays."""
        if records is not None:
            self.send(packets(records))
        flags = [byref(c_bool()) for _ in range(3)]
        self.call("DoStep", c_double(t), c_double(h), True, *flags, byref(c_double()))
        return unframe("RCPT", self.receptions(), RECEPTION)

    def receptions(self) -> bytes:
        """The output."""
        reference, _ = self.library.variables["receptions"]
        size, data = c_size_t(), c_void_p()
        self.call("GetBinary", byref(c_uint32(reference)), c_size_t(1), byref(size),
                  byref(data), c_size_t(1))  # fmt: skip
        return ctypes.string_at(data, size.value) if size.value else b""

    def save(self) -> bytes:
        """The state as bytes."""
        state, size = c_void_p(), c_size_t()
        self.call("GetFMUState", byref(state))
        self.call("SerializedFMUStateSize", state, byref(size))
        data = ctypes.create_string_buffer(size.value)
        self.call("SerializeFMUState", state, data, size)
        self.call("FreeFMUState", byref(state))
        return data.raw

    def restore(self, data: bytes) -> None:
        """Return to a saved state."""
        state = c_void_p()
        self.call("DeserializeFMUState", data, c_size_t(len(data)), byref(state))
        try:
            self.call("SetFMUState", state)
        finally:
            self.call("FreeFMUState", byref(state))


def row_of_cars(distances: Sequence[float]) -> Scene:
    """Cars side by side with vehicle 0, at these distances from it along x, 3 m apart along y."""
    cars = [Vehicle(id=0)]
    cars += [
        Vehicle(id=k, position=(distance, 3.0 * k, 0.0))
        for k, distance in enumerate(distances, start=1)
    ]
    return Scene(vehicles=cars)


def one_frame(library: Library, scene: Scene, record: Array, **parameters: float) -> dict[int, Any]:
    """The receptions of one packet, by receiver."""
    with Channel(library, scene, **parameters) as channel:
        received = channel.step(0.0, 0.1, [record])
        return {int(r["receiver"]): r for r in received if r["hop"] == 0}


def reception_ratio(library: Library, scene: Scene, frames: int, **parameters: float) -> Array:
    """The share of vehicle 0's frames that each other vehicle receives (PRR)."""
    with Channel(library, scene, **parameters) as channel:
        records = [packet(k, 0, time=k * MS) for k in range(frames)]
        received = channel.step(0.0, frames * 1e-3 + 1, records)
    good = received[received["outcome"] == OUTCOMES.index("R")]
    counts = [np.count_nonzero(good["receiver"] == v.id) for v in scene.vehicles[1:]]
    return np.array(counts) / frames


def rectangle(x: float, y: float, length: float, width: float) -> tuple[tuple[float, float], ...]:
    """Corners of an upright rectangle around (x, y), counter-clockwise [m]."""
    a, b = length / 2, width / 2
    return ((x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b))


def run(
    channel: Channel, cuts: Sequence[float], records: Sequence[Array]
) -> tuple[Array, list[bytes]]:
    """All receptions of steps between neighbouring `cuts` [s], and each step's output.

    Each packet is handed over in the last step that begins before its time or with it.
    """
    outputs = []
    for t, end in itertools.pairwise(cuts):
        begin, stop = round(t * 1e9), round(end * 1e9)
        channel.step(t, end - t, [r for r in records if begin <= r["time"] < stop])
        outputs.append(channel.receptions())
    return np.concatenate([unframe("RCPT", data, RECEPTION) for data in outputs]), outputs
