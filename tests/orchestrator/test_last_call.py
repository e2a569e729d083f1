"""What a run notes of its calls can be read when its process is gone, and only then."""

import ctypes
import struct
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import pytest
from typing_extensions import override

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.last_call import FILE, Call, CutOff, LastCall, LastCallFile, cut_off
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, Time
from tests.idle import Idle

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="files that are open are locked")

NAMES = ["first", "zweiter ö", "third"]


class State(ctypes.Structure):
    """Of compiled code."""

    _fields_ = (("other", ctypes.c_int32), ("number", ctypes.c_size_t), ("time", ctypes.c_int64))


class Large(ctypes.Structure):
    """One byte more than there is room for."""

    _fields_ = (("bytes", ctypes.c_uint8 * 961),)


def left(directory: Path) -> CutOff | None:
    """What is read of a file whose process let it go."""
    content = (directory / FILE).read_bytes()
    (directory / FILE).unlink()
    (directory / FILE).write_bytes(content)
    return cut_off(directory)


@pytest.mark.parametrize(
    ("call", "doing"),
    [
        (Call.SET_UP, "being set up"),
        (Call.INITIALISE, "being initialised"),
        (Call.STEP, "stepping"),
        (Call.STATE, "saving or restoring its state"),
        (Call.CLOSE, "being closed"),
    ],
)
def test_the_newest_call_is_read(tmp_path: Path, call: Call, doing: str) -> None:
    noted = LastCallFile(tmp_path, NAMES)
    noted.begin(NAMES)
    noted.notes_of(0).step(7)
    noted.notes_of(1).call(call, -1_250_000_000)
    assert left(tmp_path) == CutOff("zweiter ö", doing, -1_250_000_000)
    assert str(left(tmp_path)) == f"`zweiter ö` was {doing} at t = -1.25 s"
    noted.notes_of(2).step(3)
    noted.nobody()


def test_between_calls_nobody_is_named(tmp_path: Path) -> None:
    noted = LastCallFile(tmp_path, NAMES)
    noted.begin(NAMES)
    noted.notes_of(2).step(500_000_000)
    noted.nobody()
    assert str(left(tmp_path)) == "nobody was stepping at t = 0.5 s"


def test_compiled_code_notes_in_its_own_state(tmp_path: Path) -> None:
    """Its numbers are those of its own order; behind its last one nobody is called."""
    noted = LastCallFile(tmp_path, NAMES)
    noted.begin(NAMES)
    state = noted.place(State)
    assert (state.other, state.number, state.time) == (0, 0, 0)
    noted.compiled(["third", "first"], State.number.offset, State.time.offset)
    noted.engine(10)
    state.other, state.number, state.time = -1, 1, 20
    assert left(tmp_path) == CutOff("first", "stepping", 20)
    content = bytearray((tmp_path / FILE).read_bytes())
    for number, expected in ((0, "third"), (2, "")):
        struct.pack_into("<Q", content, 64 + State.number.offset, number)
        (tmp_path / FILE).write_bytes(content)
        found = cut_off(tmp_path)
        assert found is not None
        assert found.component == expected


def test_a_state_that_is_too_large_is_elsewhere(tmp_path: Path) -> None:
    noted = LastCallFile(tmp_path, NAMES)
    state = noted.place(Large)
    noted.begin(NAMES)
    noted.notes_of(2).step(3)
    ctypes.memset(ctypes.addressof(state), 255, ctypes.sizeof(state))
    assert left(tmp_path) == CutOff("third", "stepping", 3)


def test_a_run_that_goes_on_was_not_cut_off(tmp_path: Path) -> None:
    noted = LastCallFile(tmp_path, NAMES)
    noted.begin(NAMES)
    assert cut_off(tmp_path) is None
    noted.remove()
    assert cut_off(tmp_path) is None
    assert list(tmp_path.iterdir()) == []
    noted.notes_of(0).step(1)  # goes nowhere, and harms nobody


@pytest.mark.parametrize("content", [b"", b"\xff" * 30, b"\xff" * 2000, bytes(1024) + b"{}"])
def test_a_file_that_is_damaged_says_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)
    assert cut_off(tmp_path) == CutOff()


def test_notes_without_a_file_are_harmless() -> None:
    noted = LastCall()
    noted.begin(NAMES)
    noted.compiled(NAMES, 0, 8)
    noted.notes_of(1).step(5)


class _Looking(Observer):
    """Notes whether a component is being called when it is asked itself."""

    def __init__(self, last_call: LastCall) -> None:
        self._cells = memoryview(last_call._memory)[:16].cast("q")
        self.seen: dict[str, int] = {}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self.seen["begin"] = self._cells[0]

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.seen["observe"] = self._cells[0]

    @override
    def end(self, result: SimulationResult) -> None:
        self.seen["end"] = self._cells[0]


class _Leaving(Idle):
    """Notes what is said to be called while it is closed; the user stops the run at 3 ns."""

    connectors: ClassVar[Mapping[str, Connector]] = {}

    def __init__(self, last_call: LastCall) -> None:
        self._cells = memoryview(last_call._memory)[:16].cast("q")
        self.closing = 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if t == 3:
            raise KeyboardInterrupt

    @override
    def outputs(self) -> Signals:
        return {}

    @override
    def close(self) -> None:
        self.closing = self._cells[0]


def test_nobody_is_called_while_observers_are_asked() -> None:
    """Not even the component that was closed last: what takes long then is not its fault."""
    last_call = LastCall()
    looking, first, second = _Looking(last_call), _Leaving(last_call), _Leaving(last_call)
    with pytest.raises(KeyboardInterrupt):
        simulate(
            System({"first": first, "second": second}, {"first": 1, "second": 1}, []),
            Jacobi(), start=0, stop=9, seed=0, observers=[looking], last_call=last_call,
        )  # fmt: skip
    assert looking.seen == {"begin": 0, "observe": 0, "end": 0}
    assert [first.closing, second.closing] == [Call.CLOSE << 32, Call.CLOSE << 32 | 1]
