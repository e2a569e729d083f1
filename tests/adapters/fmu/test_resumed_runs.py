"""FMUs come back to a checkpoint, also where compiled code steps them: the same bytes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.recording import parts
from orchestrator.resuming.files import checkpoints_of
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import StepSize
from orchestrator.transformation import PLAIN
from tests.orchestrator.resumable import Noise, contents, cut_and_resumed, run

MS = 1_000_000
S = 1000 * MS
AS_NUMBERS = replace(PLAIN, converts=False)


def made_of(
    paths: Mapping[str, tuple[Path, StepSize]],
    wires: Sequence[str],
    values: Mapping[str, object] | None = None,
) -> Callable[[], System]:
    """A system of FMUs, and of `noise`, which steps every 20 ms."""

    def made() -> System:
        components: dict[str, Component] = {
            name: FmuComponentType(path).create(name, dict(values or {}))
            for name, (path, _) in paths.items()
        }
        sizes: dict[str, StepSize] = {name: step for name, (_, step) in paths.items()}
        components["noise"], sizes["noise"] = Noise(is_portable=True), 20 * MS
        links = [
            Connection(Endpoint(*source.split(".")), Endpoint(*target.split(".")), AS_NUMBERS)
            for source, target in (wire.split(" > ") for wire in wires)
        ]
        return System(components, sizes, links)

    return made


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of a recording that end here and there."""
    monkeypatch.setattr(parts, "BLOCK_BYTES", 3000)


@pytest.mark.parametrize("include", ["*", "?.sum"], ids=["all", "selected"])
@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()], ids=["jacobi", "gauss-seidel"])
def test_compiled_code_goes_on(
    tmp_path: Path,
    bilinear3: Path,
    product2: Path,
    algorithm: CosimulationAlgorithm,
    include: str,
) -> None:
    fmus: dict[str, tuple[Path, StepSize]] = {
        "a": (bilinear3, MS),
        "b": (bilinear3, 2 * MS),
        "c": (product2, MS),
    }
    system = made_of(fmus, ["a.sum > b.p", "b.sum > c.a", "noise.y > a.p", "c.y > b.q"])
    kept = (include,)
    whole, result = run(tmp_path / "whole", system(), algorithm, S, every=10 * S, include=kept)
    found, fingerprint, again = cut_and_resumed(
        tmp_path / "cut", system, algorithm, S, every=130 * MS, cut=700 * MS, include=kept
    )
    assert found.time == 660 * MS  # 650 ms, where 20 ms are due
    assert found.found is not None
    assert list(found.found.content["states"]) == ["a", "b", "c", "noise"]
    assert fingerprint == whole
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")
    for component, values in result.values.items():
        for connector, value in values.items():
            assert np.array_equal(again.values[component][connector], value)


def test_who_is_stepped_by_compiled_code_and_cannot_save_steps_again(
    tmp_path: Path, lag2: Path, caplog: pytest.LogCaptureFixture
) -> None:
    system = made_of({"lag": (lag2, MS)}, ["noise.y > noise.u"])
    whole, _ = run(tmp_path / "whole", system(), Jacobi(), S, every=10 * S)
    with caplog.at_level("INFO"):
        found, fingerprint, _ = cut_and_resumed(
            tmp_path / "cut", system, Jacobi(), S, every=100 * MS, cut=700 * MS
        )
    assert checkpoints_of(tmp_path / "cut") == ()
    assert "`lag` cannot save the state, and compiled code steps it" in caplog.text
    assert found.time is None
    assert fingerprint == whole


def test_events_that_are_to_come_are_known(tmp_path: Path, events3: Path) -> None:
    """A time event every 70 ms, and a level that jumps."""
    system = made_of(
        {"unit": (events3, 10 * MS)},
        ["noise.y > unit.level", "unit.x > noise.u"],
        {"period": 0.07, "threshold": 0.02, "rounds": 2},
    )
    whole, result = run(tmp_path / "whole", system(), Jacobi(), S, every=10 * S)
    assert int(np.asarray(result.values["unit"]["ticks"])) == 14
    found, fingerprint, _ = cut_and_resumed(
        tmp_path / "cut", system, Jacobi(), S, every=100 * MS, cut=670 * MS
    )
    assert found.time == 600 * MS
    assert fingerprint == whole
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")


def test_without_bytes_an_fmu_steps_again_with_its_courses(tmp_path: Path, mass2: Path) -> None:
    system = made_of({"mass": (mass2, 10 * MS)}, ["noise.y > mass.xin", "mass.x > noise.u"])
    algorithm = Jacobi(extrapolation="linear")
    whole, _ = run(tmp_path / "whole", system(), algorithm, S, every=10 * S)
    found, fingerprint, _ = cut_and_resumed(
        tmp_path / "cut", system, algorithm, S, every=100 * MS, cut=670 * MS
    )
    assert found.found is not None
    assert found.found.content["steps"]["mass"]["count"] == 60
    assert fingerprint == whole
