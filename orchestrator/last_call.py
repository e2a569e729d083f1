"""The call that a run made last, in memory that is still there when the process is not.

A component that crashes takes its process with it: nobody is left to say who it was. So the run
notes which component it calls, and from which time, in a small file of the run directory that is
mapped into memory: two stores for a call, and the system keeps them whatever becomes of the
process. At the end of the run, however it ended, the file is removed; one that lies there and is
locked by nobody is of a run that was cut off.

    offset 0    i64  the call: what is done, times 2^32, and the number of the component
    offset 8    i64  the time it works from [ns]
    offset 16   u64  length of the text
    offset 64        room for the state of compiled code that calls components by itself
    offset 1024      text, JSON: the names of components, and where compiled code notes which
"""

import ctypes
import enum
import json
import mmap
import os
import struct
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter_ns
from typing import Any, Final, TypeVar

from typing_extensions import override

from orchestrator.disk import naming
from orchestrator.timebase import Time, seconds

if sys.platform != "win32":
    import fcntl

FILE: Final = "last-call"

_TEXT: Final = 1024
_STATE: Final = 64
_HEAD: Final = struct.Struct("<qqQ")
_KIND: Final = 32

_Structure = TypeVar("_Structure", bound=ctypes.Structure)


class Call(enum.IntEnum):
    """What is asked of a component."""

    NONE = 0
    SET_UP = 1
    INITIALISE = 2
    STEP = 3
    STATE = 4
    CLOSE = 5
    COMPILED = 6


_DOING: Final = {
    Call.SET_UP: "being set up",
    Call.INITIALISE: "being initialised",
    Call.STEP: "stepping",
    Call.STATE: "saving or restoring its state",
    Call.CLOSE: "being closed",
}


class Notes:
    """What a run notes of one component.

    Attributes:
        stepping: how a step is noted.
    """

    __slots__ = ("_cells", "_number", "stepping")

    def __init__(self, cells: "memoryview[int]", number: int) -> None:
        """Note calls of the component `number` in `cells`."""
        self._cells, self._number = cells, number
        self.stepping = Call.STEP << _KIND | number

    def step(self, t: Time) -> int:
        """Note a step from `t`; the time on the clock of `perf_counter_ns`."""
        self._cells[0], self._cells[1] = self.stepping, t
        return perf_counter_ns()

    def call(self, call: Call, t: Time) -> int:
        """Note any call at `t`; the time on the clock of `perf_counter_ns`."""
        self._cells[0], self._cells[1] = call << _KIND | self._number, t
        return perf_counter_ns()


class LastCall:
    """Where a run notes what it calls."""

    def __init__(self, memory: bytearray | mmap.mmap | None = None) -> None:
        """Note calls in `memory`; without, in some that ends with the process."""
        self._memory = bytearray(_TEXT) if memory is None else memory
        self._cells: memoryview[int] = memoryview(self._memory)[:16].cast("q")
        self._text: dict[str, Any] = {}

    def begin(self, names: Sequence[str]) -> None:
        """Say what the components are called, in the order of their numbers."""
        self._text = {"names": list(names)}
        self._write()

    def notes_of(self, number: int) -> Notes:
        """Where the calls of a component are noted."""
        return Notes(self._cells, number)

    def nobody(self) -> None:
        """Note that no component is called."""
        self._cells[0] = 0

    def engine(self, t: Time) -> None:
        """Note that compiled code works from `t`."""
        self._cells[0], self._cells[1] = Call.COMPILED << _KIND, t

    def place(self, structure: type[_Structure]) -> _Structure:
        """Memory for the state of compiled code, all zeros; where it is too large, other memory."""
        size = ctypes.sizeof(structure)
        if size > _TEXT - _STATE:
            return structure()
        self._memory[_STATE : _STATE + size] = bytes(size)
        return structure.from_buffer(self._memory, _STATE)

    def compiled(self, names: Sequence[str], number: int, time: int) -> None:
        """Say what compiled code calls.

        Args:
            names: of the components that it calls, in its own order.
            number: offset in the structure of the number in that order, u64.
            time: likewise of the time that the call works from [ns], i64.
        """
        self._text |= {"compiled": list(names), "number": _STATE + number, "time": _STATE + time}
        self._write()

    def _write(self) -> None:
        text = json.dumps(self._text).encode()
        if _TEXT + len(text) <= len(self._memory):
            self._memory[_TEXT : _TEXT + len(text)] = text
            struct.pack_into("<Q", self._memory, 16, len(text))


NOWHERE: Final = LastCall()
"""Notes that nobody reads."""


class LastCallFile(LastCall):
    """Memory that is a file in the run directory `directory`, which has one run at a time."""

    def __init__(self, directory: Path, names: Sequence[str]) -> None:
        self._path = directory.absolute() / FILE
        room = _TEXT + 1024 + 3 * len(json.dumps(list(names)))
        self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
        if sys.platform != "win32":
            fcntl.flock(self._descriptor, fcntl.LOCK_EX)
        try:
            with naming(self._path):
                _reserve(self._descriptor, room)
        except OSError:
            self.remove()
            raise
        super().__init__(mmap.mmap(self._descriptor, room))

    def remove(self) -> None:
        """The run came to its end; further notes go nowhere."""
        self._path.unlink(missing_ok=True)
        os.close(self._descriptor)


def _reserve(descriptor: int, size: int) -> None:
    """Give a file its size; where the disk is full, now and not when its memory is written to."""
    if sys.platform == "linux":
        os.posix_fallocate(descriptor, 0, size)
    else:
        os.ftruncate(descriptor, size)


@contextmanager
def noting(directory: Path, names: Sequence[str]) -> Iterator[LastCall]:
    """Where the run in `directory` notes its calls; if the block is not left, it stays there."""
    last_call = LastCallFile(directory, names)
    try:
        yield last_call
    finally:
        last_call.remove()


@dataclass(frozen=True, slots=True)
class CutOff:
    """What a run did last that was cut off.

    Attributes:
        component: that was called; empty if none was, or if nothing is known.
        doing: what was asked of it, as a participle.
        time: that the call works from [ns].
    """

    component: str = ""
    doing: str = ""
    time: Time = 0

    @override
    def __str__(self) -> str:
        what = f"`{self.component}` was {self.doing}" if self.component else "nobody was stepping"
        return f"{what} at t = {seconds(self.time):.9g} s"


def called(directory: Path) -> CutOff | None:
    """What the run in `directory` does now, or did last; `None` if it came to its end."""
    try:
        return _read((directory / FILE).read_bytes())
    except OSError:
        return None


def cut_off(directory: Path) -> CutOff | None:
    """What the run in `directory` did last; `None` if it came to its end, or goes on."""
    try:
        descriptor = os.open(directory / FILE, os.O_RDONLY)
    except OSError:
        return None
    with os.fdopen(descriptor, "rb") as file:
        if sys.platform != "win32":
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError:
                return None
        return _read(file.read())


def _read(content: bytes) -> CutOff:
    try:
        noted, time, length = _HEAD.unpack_from(content)
        text = json.loads(content[_TEXT : _TEXT + length])
        call, number, names = Call(noted >> _KIND), noted & 0xFFFFFFFF, text["names"]
        if call is Call.COMPILED:
            call, names = Call.STEP, text["compiled"]
            number = int.from_bytes(content[text["number"] :][:8], "little")
            time = int.from_bytes(content[text["time"] :][:8], "little", signed=True)
    except (struct.error, ValueError, KeyError):
        return CutOff()
    if call is Call.NONE or number >= len(names):
        return CutOff(time=time)
    return CutOff(names[number], _DOING[call], time)
