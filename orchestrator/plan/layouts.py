"""The structures of `engine.c`, and the engine itself."""

import ctypes
import functools
import platform
from ctypes import POINTER, c_double, c_int, c_int32, c_int64, c_size_t, c_uint64, c_void_p
from pathlib import Path
from typing import Any, Final

ALL_DONE, SET_FAILED, STEP_FAILED, GET_FAILED, NOT_FINITE, NO_MEMORY, RUN_ENDS, RUN_ENDED = range(8)
"""What `plan_run` returns."""

GOES_ON, ENDS_BEHIND, ENDS_WITHIN, HAS_FAILED = range(4)
"""What `attend` returns."""

Attend = ctypes.CFUNCTYPE(c_int, c_int, c_int64)
"""Makes the rest of a step: takes its status and where it begins [ns]."""


class Bytes(ctypes.Structure):
    """A value of type Binary, in memory of the engine."""

    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))


class Copy(ctypes.Structure):
    """Where values of a call come from."""

    _fields_ = (
        ("source", c_void_p), ("to", c_void_p), ("size", c_size_t), ("version", c_void_p),
        ("seen", c_uint64),
    )  # fmt: skip


class Setting(ctypes.Structure):
    """A call that sets inputs."""

    _fields_ = (
        ("function", c_void_p), ("reference", c_void_p), ("references", c_size_t),
        ("elements", c_void_p), ("count", c_size_t), ("kind", c_int32), ("is_binary", c_int32),
        ("copy", POINTER(Copy)), ("copies", c_size_t),
    )  # fmt: skip


class Getting(ctypes.Structure):
    """A call that gets outputs."""

    _fields_ = (
        ("function", c_void_p), ("reference", c_void_p), ("references", c_size_t),
        ("elements", c_void_p), ("count", c_size_t), ("kind", c_int32), ("is_binary", c_int32),
        ("signal", c_void_p), ("sizes", c_void_p), ("pointers", c_void_p),
    )  # fmt: skip


class Track(ctypes.Structure):
    """A recorded output."""

    _fields_ = (
        ("source", c_void_p), ("size", c_size_t), ("row", c_void_p), ("is_binary", c_int32),
        ("bytes", Bytes),
    )  # fmt: skip


class Unit(ctypes.Structure):
    """An instance, its calls and its outputs."""

    _fields_ = (
        ("instance", c_void_p), ("step", c_void_p), ("version", c_int32), ("keeps_state", c_int32),
        ("step_size", c_int64), ("setting", POINTER(Setting)), ("settings", c_size_t),
        ("getting", POINTER(Getting)), ("gettings", c_size_t), ("pending", c_void_p),
        ("published", c_void_p), ("size", c_size_t), ("pending_bytes", POINTER(Bytes)),
        ("published_bytes", POINTER(Bytes)), ("binaries", c_size_t), ("track", POINTER(Track)),
        ("tracks", c_size_t), ("due", c_int64), ("rows", c_size_t), ("publications", c_uint64),
        ("calls", c_uint64), ("spent", c_double), ("flag", c_void_p * 3), ("last_time", c_void_p),
        ("attend", c_void_p), ("ending", c_int64),
    )  # fmt: skip


class Plan(ctypes.Structure):
    """All units, and how far they are."""

    _fields_ = (
        ("unit", POINTER(Unit)), ("units", c_size_t), ("is_parallel", c_int32),
        ("is_departed", c_int32), ("start", c_int64), ("until", c_void_p), ("now", c_int64),
        ("end", c_int64), ("most", c_size_t), ("points", c_size_t),
        ("failed", c_size_t), ("call", c_size_t), ("failed_from", c_int64), ("status", c_int32),
        ("pad", c_int32),
    )  # fmt: skip


SUFFIXES: Final = {"Linux": ".so", "Darwin": ".dylib", "Windows": ".dll"}
"""How the names of shared libraries end, by operating system."""


def engine_path() -> Path:
    """Where the engine for this machine is, if it was built."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    system = platform.system()
    name = f"engine-{machine}-{system.lower()}{SUFFIXES.get(system, '.so')}"
    return Path(__file__).parent / name


@functools.cache
def engine() -> Any:
    """The engine, or `None` where there is none: plans are then worked through in Python."""
    path = engine_path()
    if not path.is_file():
        return None
    library = ctypes.CDLL(str(path))
    library.plan_run.argtypes = (POINTER(Plan),)
    library.plan_run.restype = c_int
    library.plan_assign.argtypes = (POINTER(Bytes), c_void_p, c_size_t)
    library.plan_assign.restype = c_int
    library.plan_release.argtypes = (POINTER(Bytes),)
    library.plan_release.restype = None
    return library
