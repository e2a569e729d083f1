"""Calls the binary of an FMU through its FMI 3.0 functions, with nothing in between."""

import ctypes
import zipfile
from collections.abc import Mapping
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, Self
from xml.etree import ElementTree as ET

import numpy as np

from fmus.native.build import build_fmu
from fmus.native.targets import host_platform, select_targets
from fmus.native.unit import load_unit
from orchestrator.signal import Array

OK: Final = 0
WARNING: Final = 1
_LOG = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
_DTYPES: Final = {
    "Float64": np.float64,
    "Int32": np.int32,
    "Int64": np.int64,
    "UInt32": np.uint32,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
}


@dataclass(frozen=True, slots=True)
class Library:
    """The binary of an FMU and what its modelDescription.xml says."""

    name: str
    folder: Path
    binary: ctypes.CDLL
    token: bytes
    variables: Mapping[str, tuple[int, str]]  # reference, type

    @classmethod
    def build(cls, name: str, folder: Path) -> Self:
        """Build the unit `name` for this machine and load it."""
        archive = build_fmu(load_unit(name), folder, targets=select_targets(["host"])).path
        with zipfile.ZipFile(archive) as file:
            file.extractall(folder)
        return cls.load(name, folder)

    @classmethod
    def load(cls, name: str, folder: Path) -> Self:
        """Load the unit `name` that has been built into a folder."""
        (path,) = (folder / "binaries" / host_platform()).iterdir()
        root = ET.parse(folder / "modelDescription.xml").getroot()  # noqa: S314 - our own file
        found = root.find("ModelVariables")
        assert found is not None
        binary = ctypes.CDLL(str(path))
        binary.fmi3InstantiateCoSimulation.restype = c_void_p
        return cls(
            name,
            folder,
            binary,
            root.attrib["instantiationToken"].encode(),
            # an Enumeration is accessed as Int64
            {
                v.attrib["name"]: (
                    int(v.attrib["valueReference"]),
                    v.tag.replace("Enumeration", "Int64"),
                )
                for v in found
            },
        )


class Refused(Exception):  # noqa: N818 - what the FMU did
    """The FMU returned an error; the message is what it logged."""


class Instance:
    """What the drivers of all units share: one instance, freed by `with`, and what it logged."""

    worst_status: ClassVar = OK
    """The worst status that is no failure."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self.messages: list[str] = []
        self._log: Any = _LOG(lambda _, __, ___, text: self.messages.append(text.decode()))
        self._instance = c_void_p(
            library.binary.fmi3InstantiateCoSimulation(
                library.name.encode(), library.token, None, False, True, False, False, None,
                c_size_t(0), None, self._log, None,
            )
        )  # fmt: skip
        assert self._instance.value is not None, self.messages

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.free()

    def free(self) -> None:
        """Free the instance."""
        self.library.binary.fmi3FreeInstance(self._instance)

    def call(self, name: str, *arguments: object) -> None:
        """Call an FMI function; raise `Refused` if it fails."""
        first = len(self.messages)
        status = getattr(self.library.binary, f"fmi3{name}")(self._instance, *arguments)
        if status > self.worst_status:
            raise Refused(" ".join(self.messages[first:]))

    def enter_initialization(self, start: float = 0.0) -> None:
        """Enter initialisation mode."""
        self.call("EnterInitializationMode", False, c_double(), c_double(start), False, c_double())

    def do_step(self, t: float, h: float) -> None:
        """Advance from t to t + h."""
        flags = [byref(c_bool()) for _ in range(3)]
        self.call("DoStep", c_double(t), c_double(h), True, *flags, byref(c_double()))

    def resize(self, **lengths: float) -> None:
        """Set structural parameters, in configuration mode."""
        self.call("EnterConfigurationMode")
        for name, value in lengths.items():
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
        self.call("DeserializeFMUState", c_char_p(data), c_size_t(len(data)), byref(state))
        try:
            self.call("SetFMUState", state)
        finally:
            self.call("FreeFMUState", byref(state))
