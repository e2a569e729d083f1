"""Small outputs go to their rows many at a time: wherever a stretch ends, all of them are there."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.ours import system_of
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.plan import layouts
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.conftest import LookAt

ALGORITHMS = pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])


def fingerprint(
    system: System,
    algorithm: CosimulationAlgorithm,
    out: Path,
    *,
    points: int,
    compiled: bool,
    include: Sequence[str] = ("*",),
) -> str:
    recorder = Recorder(out, include=include)
    simulate(
        system, algorithm, start=0, stop=points * STEP_NS, seed=0, observers=[recorder],
        compiled=compiled,
    )  # fmt: skip
    return recorder.fingerprint


@ALGORITHMS
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("points", [1, 4, 31, 32, 33, 64, 65, 100, 163])
def test_numbers_of_one_four_and_eight_bytes(
    tmp_path: Path, points: int, version: int, algorithm: CosimulationAlgorithm
) -> None:
    """A source and FMUs that pass on what they get, which changes with every step."""
    plain, compiled = (
        fingerprint(
            system_of(Chain("feedthrough", version, 3)), algorithm, tmp_path / str(c),
            points=points, compiled=c,
        )
        for c in (False, True)
    )  # fmt: skip
    assert plain == compiled


@ALGORITHMS
def test_some_of_the_outputs(tmp_path: Path, algorithm: CosimulationAlgorithm) -> None:
    plain, compiled = (
        fingerprint(
            system_of(Chain("feedthrough", 3, 3)), algorithm, tmp_path / str(c),
            points=45, compiled=c, include=("*.UInt8_out_1", "*.Boolean_out_1"),
        )
        for c in (False, True)
    )  # fmt: skip
    assert plain == compiled


@ALGORITHMS
@pytest.mark.parametrize("channels", [2, 3, 31, 32, 100])
def test_arrays_of_any_size(
    fmu: Callable[[str], Path], tmp_path: Path, channels: int, algorithm: CosimulationAlgorithm
) -> None:
    """256 bytes with the seed are small, 264 are not; x falls from 1 to 0 in all of them."""
    runs = []
    for compiled in (False, True):
        component = FmuComponentType(fmu("lag")).create("lag", {"n_channel": channels})
        system = System({"lag": component}, {"lag": STEP_NS}, [])
        out = tmp_path / str(compiled)
        runs.append(fingerprint(system, algorithm, out, points=77, compiled=compiled))
    assert runs[0] == runs[1]
    found = Recording(tmp_path / "True")["lag.x"]
    assert len({float(found[k][-1]) for k in range(len(found))}) == 78


def test_small_outputs_have_a_shelf_large_ones_none(
    fmu: Callable[[str], Path], tmp_path: Path, look_at_plans: LookAt
) -> None:
    """Of whole words of 8 bytes, however many bytes the outputs are."""
    seen: list[list[int]] = []
    look_at_plans(
        lambda plan: seen.append([u.size if u.shelf else 0 for u in plan.unit[: plan.units]])
    )
    lag = FmuComponentType(fmu("lag"))
    chain = system_of(Chain("feedthrough", 2, 2))
    lags = {f"lag{n}": lag.create(f"lag{n}", {"n_channel": n}) for n in (31, 32)}
    components = {**chain.components, **lags}
    system = System(components, dict.fromkeys(components, STEP_NS), [])
    fingerprint(system, GaussSeidel(), tmp_path / "run", points=10, compiled=True)
    assert seen[0] == [24, 24, 256, 0]


def test_the_shelf_has_as_many_places_here_as_there() -> None:
    engine = Path(layouts.__file__).with_name("engine.c").read_text(encoding="utf-8")
    assert f"enum {{ SHELF = {layouts.SHELF} }};" in engine
