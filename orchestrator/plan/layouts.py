"""The structures of `engine.c`, `link.h`, `mixing.h` and `numbers.h`, and the engine itself."""

import ctypes
import functools
from ctypes import POINTER, c_double, c_int, c_int32, c_int64, c_size_t, c_uint8, c_uint64, c_void_p
from typing import Any, Final

import numpy as np

from orchestrator import compiled

(
    ALL_DONE, SET_FAILED, STEP_FAILED, GET_FAILED, NOT_FINITE, NO_MEMORY, RUN_ENDS, MIX_NOT_FINITE,
    RUN_ENDED, HAS_PAUSED,
) = range(10)  # fmt: skip
"""What `plan_run` returns."""

GOES_ON, ENDS_BEHIND, ENDS_WITHIN, HAS_FAILED = range(4)
"""What `attend` returns."""

SHELF: Final = 32
"""Points of which the engine keeps small outputs before they go to their rows."""

Attend = ctypes.CFUNCTYPE(c_int, c_int, c_int64)
"""Makes the rest of a step: takes its status and where it begins [ns]."""


TYPES: Final = {
    np.dtype(code): k
    for k, code in enumerate(("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "?"))
}
"""Element types that mixed inputs may have and read, by their numbers in `mixing.h`."""


class Bytes(ctypes.Structure):
    """A value of type Binary, in memory of the engine."""

    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))


class Source(ctypes.Structure):
    """A value that others may see: by the address of the address of its block."""

    _fields_ = (("base", c_void_p), ("offset", c_size_t), ("version", c_void_p))


class Copy(ctypes.Structure):
    """Where values of a call come from."""

    _fields_ = (("source", Source), ("to", c_void_p), ("size", c_size_t), ("seen", c_uint64))


class Operation(ctypes.Structure):
    """An operation of `orchestrator.operation`."""

    _fields_ = (("kind", c_int32), ("pad", c_int32), ("number", c_double))


class Past(ctypes.Structure):
    """What an output showed lately."""

    _fields_ = (
        ("source", Source), ("time", c_void_p), ("row", c_void_p), ("size", c_size_t),
        ("rows", c_uint64), ("count", c_uint64),
    )  # fmt: skip


class Term(ctypes.Structure):
    """An output as it enters an input."""

    _fields_ = (
        ("source", Source), ("past", POINTER(Past)), ("delay", c_int64), ("sample", c_int64),
        ("held", c_void_p), ("held_from", c_int64), ("held_number", c_uint64), ("at", c_uint64),
        ("seen", c_uint64), ("value", c_void_p), ("index", c_void_p), ("count", c_size_t),
        ("operation", POINTER(Operation)), ("operations", c_size_t), ("type", c_int32),
        ("pad", c_int32),
    )  # fmt: skip


class Part(ctypes.Structure):
    """Elements of an input, and the terms whose sum they are."""

    _fields_ = (
        ("term", POINTER(Term)), ("terms", c_size_t), ("place", c_void_p), ("count", c_size_t)
    )  # fmt: skip


class Mix(ctypes.Structure):
    """An input that is made of outputs."""

    _fields_ = (
        ("part", POINTER(Part)), ("parts", c_size_t), ("count", c_size_t), ("start", c_void_p),
        ("made", c_void_p), ("sum", c_void_p), ("value", c_void_p), ("rest", c_void_p),
        ("input", c_void_p), ("size", c_size_t), ("version", c_uint64), ("type", c_int32),
        ("is_new", c_int32),
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
        ("signal", c_size_t), ("sizes", c_void_p), ("pointers", c_void_p),
    )  # fmt: skip


class Track(ctypes.Structure):
    """A recorded output."""

    _fields_ = (
        ("offset", c_size_t), ("size", c_size_t), ("row", c_void_p), ("is_binary", c_int32),
        ("bytes", Bytes),
    )  # fmt: skip


class Grid(ctypes.Structure):
    """Communication points: start + k * numerator / denominator [ns]."""

    _fields_ = (("start", c_int64), ("numerator", c_int64), ("denominator", c_int64))


REPLY: Final = 56
"""A usual reply, with its length in front of it [byte]."""


Say = ctypes.CFUNCTYPE(None)
"""Sends the command of a link."""

Hear = ctypes.CFUNCTYPE(c_int32)
"""Waits for a reply for some time; whether it was the usual one."""


class Link(ctypes.Structure):
    """The way to a component in another process."""

    _fields_ = (
        ("say", c_void_p), ("hear", c_void_p), ("command", c_void_p), ("size", c_size_t),
        ("inputs", c_size_t), ("slot", c_void_p * 2),
        ("sequence", c_uint64), ("came", c_size_t), ("reply", c_uint8 * REPLY),
        ("usual", c_uint8 * REPLY), ("descriptor", c_int32), ("is_begun", c_int32),
        ("is_handed", c_int32), ("pad", c_int32),
    )  # fmt: skip


class Read(ctypes.Structure):
    """A unit that another one reads."""

    _fields_ = (("unit", c_size_t), ("leads", c_int64))


NEVER: Final = ctypes.c_size_t(-1).value
"""What stands for a turn that does not come."""


class Unit(ctypes.Structure):
    """An instance, its calls and its outputs."""

    _fields_ = (
        ("instance", c_void_p), ("step", c_void_p), ("version", c_int32), ("keeps_state", c_int32),
        ("grid", Grid), ("mix", POINTER(Mix)), ("mixes", c_size_t),
        ("setting", POINTER(Setting)), ("settings", c_size_t), ("getting", POINTER(Getting)),
        ("gettings", c_size_t), ("pending", c_void_p), ("published", c_void_p),
        ("pending_bytes", c_void_p), ("published_bytes", c_void_p),
        ("past", POINTER(POINTER(Past))), ("pasts", c_size_t), ("track", POINTER(Track)),
        ("tracks", c_size_t), ("shelf", c_void_p), ("size", c_size_t), ("shelved", c_size_t),
        ("step_size", c_double), ("records_apart", c_int64), ("number", c_int64),
        ("from_", c_int64), ("due", c_int64), ("rows", c_size_t), ("publications", c_uint64),
        ("calls", c_uint64), ("spent", c_double), ("flag", c_void_p * 3), ("last_time", c_void_p),
        ("attend", c_void_p), ("ending", c_int64), ("link", POINTER(Link)),
        ("read", POINTER(Read)), ("reads", c_size_t), ("early", c_size_t), ("onward", c_size_t),
    )  # fmt: skip


class Plan(ctypes.Structure):
    """All units, and how far they are."""

    _fields_ = (
        ("unit", POINTER(Unit)), ("units", c_size_t), ("is_parallel", c_int32),
        ("is_departed", c_int32), ("has_links", c_int64), ("start", c_int64),
        ("until", Source), ("now", c_int64),
        ("point", c_int64), ("end", c_int64), ("most", c_size_t), ("points", c_size_t),
        ("failed", c_size_t), ("call", c_size_t), ("failed_from", c_int64), ("status", c_int32),
        ("pad", c_int32),
    )  # fmt: skip


STRUCTURES: Final = (
    Plan, Unit, Setting, Getting, Track, Copy, Mix, Part, Term, Past, Bytes, Link, Read
)  # fmt: skip
"""Those whose sizes the engine is asked for."""


@functools.cache
def engine() -> Any:
    """The engine; `None` if there is none, or one of another release. Python does the work then."""
    library: Any = compiled.library()
    if library is None:
        return None
    sizes = (c_size_t * (len(STRUCTURES) + 1))(*map(ctypes.sizeof, STRUCTURES))
    if not hasattr(library, "plan_fits") or not library.plan_fits(sizes):
        return None
    library.plan_run.argtypes = (POINTER(Plan),)
    library.plan_run.restype = c_int
    library.plan_assign.argtypes = (POINTER(Bytes), c_void_p, c_size_t)
    library.plan_assign.restype = c_int
    library.plan_release.argtypes = (POINTER(Bytes),)
    library.plan_release.restype = None
    return library
