"""What an FMI 3.0 FMU shows within a step is logged, if somebody asks for it."""

import ctypes
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.block import Block
from adapters.fmi.description import read_description
from adapters.fmi.errors import FmuError
from adapters.fmi.intermediate import IntermediateUpdates
from adapters.fmi.messages import MessageLog
from adapters.fmi.variable import DTYPES
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import ParameterError
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.descriptions import changed

MS = 1_000_000


@pytest.fixture
def shows3(ends3: Path, tmp_path: Path) -> Path:
    """`ends3`, saying that it shows `y`."""
    return changed(
        ends3, tmp_path,
        (b'modelIdentifier="ends3"', b'modelIdentifier="ends3" providesIntermediateUpdate="true"'),
        (b'<Float64 name="y"', b'<Float64 name="y" intermediateUpdate="true"'),
    )  # fmt: skip


@pytest.mark.parametrize("compiled", [False, True])
def test_it_is_logged_in_the_middle_of_each_step(
    shows3: Path,
    compiled: bool,  # noqa: FBT001  (a parameter)
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The FMU shows it twice, and lets it be got once; nobody asks it to return early."""
    caplog.set_level("INFO", "nlosim.fmu.unit")
    component = FmuComponentType(shows3).create("unit", {"fmi.intermediate": ("y*",)})
    system = System({"unit": component}, {"unit": MS}, [])
    simulate(system, Jacobi(), start=0, stop=8 * MS, seed=1, compiled=compiled)
    assert [record.getMessage() for record in caplog.records] == [
        f"within a step, at {k / 1000 + 0.0005:.9g} s: y = {k / 1000 + 0.0005}" for k in range(8)
    ]


def test_without_anybody_who_asks_there_is_no_callback(
    shows3: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "nlosim.fmu.unit")
    component = FmuComponentType(shows3).create("unit", {})
    simulate(System({"unit": component}, {"unit": MS}, []), Jacobi(), start=0, stop=MS, seed=1)
    assert caplog.records == []


def test_only_what_is_shown_can_be_asked_for(shows3: Path, ends3: Path) -> None:
    assert "fmi.intermediate" not in FmuComponentType(ends3).parameters
    message = "nothing that is shown within steps matches `z`; there are: y"
    with pytest.raises(ParameterError, match=message):
        FmuComponentType(shows3).create("unit", {"fmi.intermediate": ("z",)})


def test_what_cannot_be_got_is_said_in_its_place(
    shows3: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Nothing may be raised into an FMU."""
    caplog.set_level("INFO", "nlosim.fmu.unit")
    y = read_description(shows3).variables["y"]

    def refuse(block: Block, elements: object) -> None:
        del block, elements
        raise FmuError("fmi3GetFloat64 returned Error")

    updates = IntermediateUpdates([y], DTYPES, MessageLog("unit"), refuse)
    updates.resize({})
    is_early, early = ctypes.c_bool(True), ctypes.c_double()
    flags = (False, True, True, True)
    updates.callback(None, 0.5, *flags, ctypes.byref(is_early), ctypes.byref(early))
    assert (is_early.value, early.value) == (False, 0.5)
    (record,) = caplog.records
    assert record.getMessage() == "within a step, at 0.5 s: fmi3GetFloat64 returned Error"
