"""Calls the perception FMU through its FMI functions, with nothing in between."""

import ctypes
import zipfile
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from fmus.apm import Apm, Float, decode, split
from fmus.common.build import build_fmu, load_unit
from fmus.common.targets import host_platform, select_targets
from fmus.records import OBJECT, unframe
from orchestrator.signal import Array

STEP: Final = 0.1
"""Communication step size of the tests [s]."""

_LOG = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
_DTYPES: Final = {
    "Float64": np.float64,
    "Int32": np.int32,
    "Int64": np.int64,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
}
_WARNING: Final = 1


class Refused(Exception):  # noqa: N818 - what the FMU did
    """The FMU returned an error; the message is what it logged."""


@dataclass(frozen=True, slots=True)
class Library:
    """The binary of an FMU and what its modelDescription.xml says."""

    binary: ctypes.CDLL
    token: bytes
    variables: dict[str, tuple[int, str]]  # reference, type
    archive: Path

    @classmethod
    def build(cls, folder: Path, *, cc: tuple[str, ...] = ()) -> "Library":
        """Build the perception FMU for this machine and load it."""
        unit = load_unit("perception")
        archive = build_fmu(unit, folder, targets=select_targets(["host"]), cc=cc).path
        with zipfile.ZipFile(archive) as file:
            file.extractall(folder)
        (path,) = (folder / "binaries" / host_platform()).iterdir()
        root = ET.parse(folder / "modelDescription.xml").getroot()  # noqa: S314 - our own file
        found = root.find("ModelVariables")
        assert found is not None
        binary = ctypes.CDLL(str(path))
        binary.fmi3InstantiateCoSimulation.restype = c_void_p
        return cls(
            binary,
            root.attrib["instantiationToken"].encode(),
            {v.attrib["name"]: (int(v.attrib["valueReference"]), v.tag) for v in found},
            archive,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """All outputs of the FMU."""

    apms_signal: bytes
    objects_signal: bytes
    centers: Float  # of the blind zones in use, (zone, 2)
    ranges: Float  # (zone,)
    sharers: Array  # in use, (sharer,)
    benefits: Float  # (sharer,)
    trigger: bool

    @property
    def messages(self) -> list[bytes]:
        """The APM messages."""
        return split(self.apms_signal)

    @property
    def apms(self) -> list[Apm]:
        """The APMs."""
        return [decode(message) for message in self.messages]

    @property
    def objects(self) -> Array:
        """The objects, OBJECT[object]."""
        return unframe("OBJS", self.objects_signal, OBJECT)


class Perception:
    """One instance. `settings` are parameters and structural parameters by name."""

    def __init__(self, library: Library, **settings: float) -> None:
        self.library = library
        self.messages: list[str] = []
        self.time = 0.0
        self._log: Any = _LOG(lambda _, __, ___, text: self.messages.append(text.decode()))
        self._instance = c_void_p(
            library.binary.fmi3InstantiateCoSimulation(
                b"perception", library.token, None, False, True, False, False, None, c_size_t(0),
                None, self._log, None,
            )
        )  # fmt: skip
        assert self._instance.value is not None, self.messages
        sizes = {name: value for name, value in settings.items() if name.startswith("n_")}
        self.resize(**{"n_route_vertex": 0, **sizes})
        for name in settings.keys() - sizes:
            self.set(name, np.array(settings[name]))
        self.call("EnterInitializationMode", False, c_double(), c_double(), False, c_double())

    def __enter__(self) -> "Perception":
        return self

    def __exit__(self, *_: object) -> None:
        self.library.binary.fmi3FreeInstance(self._instance)

    def call(self, name: str, *arguments: object) -> None:
        """Call an FMI function; raise `Refused` if it fails. Warnings stay in `messages`."""
        self.messages.clear()
        status = getattr(self.library.binary, f"fmi3{name}")(self._instance, *arguments)
        if status > _WARNING:
            raise Refused(" ".join(self.messages))

    def resize(self, **sizes: float) -> None:
        """Set structural parameters."""
        self.call("EnterConfigurationMode")
        for name, value in sizes.items():
            self.set(name, np.array(value))
        self.call("ExitConfigurationMode")

    def set(self, name: str, value: Array | bytes) -> None:
        """Set one variable."""
        reference, kind = self.library.variables[name]
        vr = byref(c_uint32(reference))
        if isinstance(value, bytes):
            self.call("SetBinary", vr, c_size_t(1), byref(c_size_t(len(value))),
                      byref(c_char_p(value)), c_size_t(1))  # fmt: skip
            return
        data: Array = np.ascontiguousarray(value, _DTYPES[kind])
        self.call(f"Set{kind}", vr, c_size_t(1), data.ctypes.data_as(c_void_p),
                  c_size_t(data.size))  # fmt: skip

    def get(self, name: str, count: int = 1) -> Array:
        """`count` elements of a numeric variable."""
        reference, kind = self.library.variables[name]
        data: Array = np.empty(count, _DTYPES[kind])
        self.call(f"Get{kind}", byref(c_uint32(reference)), c_size_t(1),
                  data.ctypes.data_as(c_void_p), c_size_t(count))  # fmt: skip
        return data

    def get_binary(self, name: str) -> bytes:
        """The bytes of a Binary variable."""
        reference, _ = self.library.variables[name]
        size, data = c_size_t(), c_void_p()
        self.call("GetBinary", byref(c_uint32(reference)), c_size_t(1), byref(size),
                  byref(data), c_size_t(1))  # fmt: skip
        return ctypes.string_at(data, size.value) if size.value else b""

    def set_inputs(
        self, points: bytes, received: bytes = b"", ego: int = -1, route: Float | None = None
    ) -> None:
        """Set every input."""
        vertices = np.empty((0, 2)) if route is None else route
        if len(vertices) != self.get("n_route_vertex")[0]:
            self.resize(n_route_vertex=len(vertices))
        self.set("points", points)
        self.set("received", received)
        self.set("ego.id", np.array(ego))
        self.set("route.vertex", vertices)

    def begin(self) -> None:
        """Leave initialisation mode."""
        self.call("ExitInitializationMode")

    def advance(self) -> list[str]:
        """Step with the inputs as set; returns what was logged."""
        flags = [byref(c_bool()) for _ in range(3)]
        self.call("DoStep", c_double(self.time), c_double(STEP), True, *flags, byref(c_double()))
        self.time += STEP
        return list(self.messages)

    def step(
        self, points: bytes, received: bytes = b"", ego: int = -1, route: Float | None = None
    ) -> Outputs:
        """One communication step, from initialisation on if it is the first."""
        if self.time == 0.0:
            self.begin()
        self.set_inputs(points, received, ego, route)
        self.advance()
        return self.outputs()

    def outputs(self) -> Outputs:
        """All outputs."""
        zones, sharers = int(self.get("n_blind_zone")[0]), int(self.get("n_sharer")[0])
        ranges = self.get("blind_zone.range", zones)
        ids = self.get("match.sharer", sharers)
        used = int((ids >= 0).sum())
        assert (ids[used:] == -1).all()
        count = int((ranges > 0).sum())
        assert (ranges[count:] == 0).all()
        return Outputs(
            apms_signal=self.get_binary("apms"),
            objects_signal=self.get_binary("objects"),
            centers=self.get("blind_zone.center", 2 * zones).reshape(-1, 2)[:count],
            ranges=ranges[:count],
            sharers=ids[:used],
            benefits=self.get("match.benefit", sharers)[:used],
            trigger=bool(self.get("match.trigger")[0]),
        )

    def serialize(self) -> bytes:
        """The state as bytes."""
        state, size = c_void_p(), c_size_t()
        self.call("GetFMUState", byref(state))
        self.call("SerializedFMUStateSize", state, byref(size))
        data = ctypes.create_string_buffer(size.value)
        self.call("SerializeFMUState", state, data, size)
        self.call("FreeFMUState", byref(state))
        return data.raw

    def restore(self, data: bytes) -> None:
        """Return to a serialized state."""
        state = c_void_p()
        self.call("DeserializeFMUState", c_char_p(data), c_size_t(len(data)), byref(state))
        try:
            self.call("SetFMUState", state)
        finally:
            self.call("FreeFMUState", byref(state))
