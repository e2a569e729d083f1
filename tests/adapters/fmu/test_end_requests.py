"""An FMU that asks for the end ends the run in good order, at the same point on every path."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.observer import SimulationResult
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System

MS = 1_000_000
END, END_WITH_WARNING, END_WITHIN = 1, 5, 6  # of `ends3`
ENDS_WITHIN, ENDS_BEHIND = 13, 14  # of `lag2`


class Ran(NamedTuple):
    """What came of a run."""

    result: SimulationResult
    fingerprint: str
    recording: Recording


class Asker(NamedTuple):
    """An FMU that asks for the end at 49.8 ms, in the step behind 49 ms or 48 ms."""

    path: Path
    values: Mapping[str, Any]
    output: str
    is_within: bool
    how: str


@pytest.fixture(params=["end", "warning", "within", "fmi2", "fmi2-within", "fmi2-within-states"])
def asker(request: pytest.FixtureRequest, ends3: Path, lag2: Path) -> Asker:
    """All the ways."""
    terminate, terminated = "`terminateSimulation`", "`fmi2Terminated`"
    if request.param.startswith("fmi2"):
        is_within = request.param != "fmi2"
        values = {"fail_at": 0.0498, "fail_as": ENDS_WITHIN if is_within else ENDS_BEHIND}
        if request.param.endswith("states"):
            values["fmi.smallest_step"] = 1e-6
        return Asker(lag2, values, "x", is_within, terminated)
    kind = {"end": END, "warning": END_WITH_WARNING, "within": END_WITHIN}[request.param]
    return Asker(ends3, {"ends_at": 0.0498, "kind": kind}, "y", kind == END_WITHIN, terminate)


def run(
    components: Mapping[str, Component],
    step: int,
    algorithm: CosimulationAlgorithm,
    out: Path,
    *,
    compiled: bool,
    connections: tuple[Connection, ...] = (),
) -> Ran:
    """Of `ends` with steps of some milliseconds, among others of one."""
    steps = {name: (step if name == "ends" else 1) * MS for name in components}
    recorder = Recorder(out)
    result = simulate(
        System(components, steps, connections), algorithm, start=0, stop=600 * MS, seed=1,
        observers=[recorder], compiled=compiled,
    )  # fmt: skip
    return Ran(result, recorder.fingerprint, Recording(out))


def specs(asker: Asker, lag2: Path) -> list[ComponentSpec]:
    """The one that asks between two others."""
    return [
        ComponentSpec(name="before", type=lag2, values={}),
        ComponentSpec(name="ends", type=asker.path, values=asker.values),
        ComponentSpec(name="behind", type=lag2, values={}),
    ]


def here(asker: Asker, lag2: Path) -> dict[str, Component]:
    """The same in this process."""
    return {
        spec.name: FmuComponentType(Path(spec.type)).create(spec.name, spec.values)
        for spec in specs(asker, lag2)
    }


def check(ran: Ran, asker: Asker, step: int) -> None:
    """All have published until the end of that step, or nobody what lies at it or behind it."""
    begin, end = {1: (49, 50), 3: (48, 51)}[step]
    last = end - 1 if asker.is_within else end
    assert ran.result.time == last * MS
    assert ran.result.status == "done"
    for name in ("before.x", "behind.x"):
        assert ran.recording[name].times[-1] == last * MS
    own = begin if asker.is_within else end
    assert ran.recording[f"ends.{asker.output}"].times[-1] == own * MS
    asked = 0.0498 if asker.is_within else end / 1000
    assert ran.result.early_end is not None
    assert ran.result.early_end.by == ("ends",)
    text = f"`ends` asks for the end ({asker.how}) at t = {asked} s"
    if asker.is_within:
        text += f"; that is within its step, so the run ends before, at t = {last / 1000} s"
    assert ran.result.early_end.text == text


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()], ids=["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("step", [1, 3])
def test_the_run_ends_for_all_with_equal_bytes_whoever_steps_them(
    asker: Asker, lag2: Path, step: int, algorithm: CosimulationAlgorithm, tmp_path: Path
) -> None:
    found = [
        run(here(asker, lag2), step, algorithm, tmp_path / str(compiled), compiled=compiled)
        for compiled in (False, True)
    ]
    for each in found:
        check(each, asker, step)
    assert found[0].fingerprint == found[1].fingerprint


class Remote(NamedTuple):
    """Components in other processes: by way to end, and `other`."""

    ways: Mapping[str, Asker]
    components: Mapping[str, Component]
    lag2: Path


@pytest.fixture(scope="module")
def remote(lag2: Path, ends3: Path) -> Iterator[Remote]:
    """One of each way to end."""
    ways = {
        name: Asker(ends3, {"ends_at": 0.0498, "kind": kind}, "y", kind == END_WITHIN, how)
        for name, kind, how in (
            ("end", END, "`terminateSimulation`"),
            ("within", END_WITHIN, "`terminateSimulation`"),
        )
    }
    named = [ComponentSpec(name=n, type=each.path, values=each.values) for n, each in ways.items()]
    named.append(ComponentSpec(name="other", type=lag2, values={}))
    with launch(named, LocalTransport()) as components:
        yield Remote(ways, components, lag2)


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()], ids=["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize("way", ["end", "within"])
def test_it_ends_so_where_it_is_in_another_process(
    way: str, remote: Remote, step: int, algorithm: CosimulationAlgorithm, tmp_path: Path
) -> None:
    asker, lag2 = remote.ways[way], remote.lag2
    local, elsewhere = here(asker, lag2), remote.components
    apart = {"before": local["before"], "ends": elsewhere[way], "behind": elsewhere["other"]}
    found = [
        run(local, step, algorithm, tmp_path / "here", compiled=True),
        run(apart, step, algorithm, tmp_path / "apart", compiled=False),
    ]
    for each in found:
        check(each, asker, step)
    assert found[0].fingerprint == found[1].fingerprint


@pytest.mark.parametrize("kind", [FixedPoint, InterfaceQuasiNewton])
@pytest.mark.parametrize("deed", [ENDS_WITHIN, ENDS_BEHIND])
def test_it_ends_so_where_steps_are_repeated(
    kind: type[CosimulationAlgorithm], deed: int, lag2: Path, tmp_path: Path
) -> None:
    """Two lags drive each other; what counts is what the last repetition of a step asked for."""
    unit = FmuComponentType(lag2)
    components = {
        "ends": unit.create("ends", {"fail_at": 0.0208, "fail_as": deed}),
        "other": unit.create("other", {}),
    }
    ring = tuple(
        Connection(Endpoint(one, "x"), Endpoint(other, "u"))
        for one, other in (("ends", "other"), ("other", "ends"))
    )
    ran = run(components, 1, kind(), tmp_path / "run", compiled=True, connections=ring)
    last = (20 if deed == ENDS_WITHIN else 21) * MS
    assert ran.result.time == last
    assert [ran.recording[f"{name}.x"].times[-1] for name in components] == [last, last]


SCENARIO = """\
schema: 1
title: One of two asks for the end
time: {stop: 1 s}
components:
  ball:
    fmu: lag2.fmu
    step: 100 ms
    process: true
    parameters: {fail_at: 350 ms, fail_as: 14}
  other: {fmu: lag2.fmu, step: 50 ms}
"""


def test_the_summary_the_manifest_and_json_say_who_and_when(
    lag2: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run with exit code 0, that ends as one with `until`, wherever the FMU is."""
    (tmp_path / "lag2.fmu").write_bytes(lag2.read_bytes())
    path, out = tmp_path / "two.yaml", tmp_path / "run"
    path.write_text(SCENARIO)
    text = "`ball` asks for the end (`fmi2Terminated`) at t = 0.4 s"
    assert main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    assert f"ended early: {text}\n0.4 s simulated in " in capsys.readouterr().out
    manifest = json.loads((out / "manifest.json").read_text())
    assert (manifest["status"], manifest["error"]) == ("done", None)
    assert (manifest["reached_ns"], manifest["stop_ns"]) == (400 * MS, 1000 * MS)
    assert manifest["ended_early"] == {"by": ["ball"], "why": text}
    assert text in (out / "log.txt").read_text()
    arguments = ["run", str(path), "--out", str(tmp_path / "b"), "--json", "--transport", "local"]
    assert main(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ended_early"] == {"by": ["ball"], "why": text}
    assert (found["simulated_s"], found["fingerprint"]) == (0.4, manifest["fingerprint"])
