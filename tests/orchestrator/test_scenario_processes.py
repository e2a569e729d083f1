"""Components that cannot be in the same process are refused before a run, at their line."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from orchestrator import registry
from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.placement import GROUP, placement, placing
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.processes import uncopied
from tests.installation import install

SCENARIO = """\
schema: 1
title: Two that hold the same
time: {stop: 1 s}
components:
  one: {type: lone, step: 1 s, parameters: {holds: the lamp}}
  other: {type: lone, step: 1 s, parameters: {holds: the lamp}}
  third: {type: lone, step: 1 s, parameters: {holds: the key}}
  free: {type: lone, step: 1 s}
  idle: {type: lone, step: 1 s}
"""
OTHER = "6:3: components.other: the lamp can be in a process once, and it is in `one`; "
RUN = "run with a transport that makes processes (`--transport local`)"
MARK = f"{OTHER}write `process: true` here"


class Processes(LoopbackTransport):
    """Says that it makes processes."""

    makes_processes = True


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(Path(__file__).parent / "packages")
    groups = {
        registry.COMPONENTS: {"lone": "lone_units:Lone"},
        GROUP: {"processes": f"{__name__}:Processes"},
    }
    install(monkeypatch, groups)
    file = tmp_path / "two.yaml"
    file.write_text(SCENARIO)
    return file


def marked(path: Path, *names: str, mark: str = "true") -> None:
    """Let these be in processes of their own."""
    text = path.read_text()
    for name in names:
        text = text.replace(f"  {name}: {{", f"  {name}: {{process: {mark}, ")
    path.write_text(text)


def said(path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What was printed, without the path of the file."""
    captured = capsys.readouterr()
    lines = (captured.out + captured.err).splitlines()
    return [line.partition(f"{path}:")[2] for line in lines if f"{path}:" in line]


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("options", [(), ("--transport", "processes")])
def test_the_second_in_this_process_is_refused_at_its_line(
    path: Path, capsys: pytest.CaptureFixture[str], command: str, options: tuple[str, ...]
) -> None:
    options = () if command == "check" else (*options, "--out", str(path.parent / "run"))
    assert main([command, str(path), *options]) == 2
    assert said(path, capsys) == [MARK]
    assert not (path.parent / "run").exists()


@pytest.mark.parametrize("names", [("one",), ("other",), ("one", "other")])
def test_in_processes_of_their_own_they_run(
    path: Path, capsys: pytest.CaptureFixture[str], names: tuple[str, ...]
) -> None:
    """With transports that leave all in this process, a run is refused."""
    marked(path, *names)
    assert main(["check", str(path)]) == 0
    verdict, effect = said(path, capsys)
    assert verdict == " ok, 5 components, 0 connections"
    assert "`process: true` means a process of its own; `nlosim run --transport in" in effect
    for transport in ("in-process", "loopback"):
        assert refused(path, capsys, "--transport", transport) == [f"{OTHER}{RUN}"]
    out = str(path.parent / "run")
    assert main(["run", str(path), "--transport", "processes", "--out", out, "--quiet"]) == 0
    placed = placement(None, load_scenario(path))
    assert (placed.transport, sorted(placed.remote)) == ("local", sorted(names))


def test_on_request_they_run_with_a_transport_only(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`check` remarks that it takes a transport, and a run without one is refused."""
    marked(path, "other", mark="on-request")
    assert main(["check", str(path)]) == 0
    remark, verdict, effect = said(path, capsys)
    problem = f"{MARK}, or {RUN}"
    assert (remark, verdict) == (f"{problem} (a remark)", " ok, 5 components, 0 connections")
    assert "`process: on-request` takes effect with `nlosim run --transport local`" in effect
    for options in ((), ("--transport", "loopback")):
        assert refused(path, capsys, *options) == [problem]
    out = str(path.parent / "run")
    assert main(["run", str(path), "--transport", "processes", "--out", out, "--quiet"]) == 0


def refused(path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[str]:
    """What is said of a run that leaves no directory."""
    out = path.parent / "refused"
    assert main(["run", str(path), *options, "--out", str(out)]) == 2
    assert not out.exists()
    return said(path, capsys)


def test_decisions_that_could_not_be_tried_are_remarked_upon(path: Path) -> None:
    """Others that are always elsewhere would not be copied; on request is no obstacle."""
    marked(path, "other", "third")
    marked(path, "one", mark="on-request")
    scenario = load_scenario(path)
    uses = dict(scenario.components)
    assert list(uncopied(scenario.document, uses)) == []
    uses["idle"] = replace(uses["idle"], type=Mock(decides=True))
    (remark,) = uncopied(scenario.document, uses)
    assert str(remark).startswith(f"{path}:9:3: component `idle` tries its alternatives in copies")
    assert "but `other` and `third`" in str(remark) or "but `other`, `third` step" in str(remark)
    del uses["other"], uses["third"]
    assert list(uncopied(scenario.document, uses)) == []


def test_limits_that_do_not_hold_are_remarked_upon(path: Path) -> None:
    marked(path, "other")
    text = path.read_text().replace("other: {", "other: {deadline: 5 s, memory: 1 GB, ")
    path.write_text(text)
    (other,) = (u for n, u in load_scenario(path).components.items() if n == "other")
    assert (other.limits.deadlines.step, other.limits.deadlines.create) == (5.0, 60.0)
    assert other.limits.memory == 10**9
    placed = placement(None, load_scenario(path))
    assert placed.remarks == ()
    path.write_text(path.read_text().replace("the lamp", "a lamp", 1))
    placed = placement("in-process", load_scenario(path))
    assert [str(each).partition(":")[2] for each in placed.remarks] == [
        f"6:{column}: components.other.{key}: nothing is limited: it runs in the "
        "orchestrator's process"
        for key, column in (("deadline", 11), ("memory", 26))
    ]


@pytest.mark.parametrize(
    ("said", "create", "setup", "written"),
    [
        ("{setup: 2 min}", 120.0, 120.0, {"setup": "120 s"}),
        ("{create: 2 min}", 120.0, 60.0, {"create": "120 s"}),
        ("{create: 3 s, setup: 4 s}", 3.0, 4.0, {"create": "3 s", "setup": "4 s"}),
    ],
)
def test_the_deadline_of_creation_is_that_of_setting_up_unless_it_is_said(
    path: Path, said: str, create: float, setup: float, written: dict[str, str]
) -> None:
    marked(path, "other")
    path.write_text(path.read_text().replace("other: {", f"other: {{deadline: {said}, "))
    scenario = load_scenario(path)
    found = scenario.components["other"].limits.deadlines
    assert (found.create, found.setup, found.step) == (create, setup, 30.0)
    assert scenario.resolved()["components"]["other"]["deadline"] == written


def test_those_that_hold_something_else_are_not_meant(path: Path) -> None:
    path.write_text(SCENARIO.replace("the lamp", "a lamp", 1))
    with placing(placement("in-process", load_scenario(path))):
        pass


def test_every_one_but_the_first_is_named_with_other_problems(path: Path) -> None:
    text = SCENARIO.replace("the key", "the lamp") + "connections: [{from: one.y, to: nobody.u}]\n"
    path.write_text(text)
    with pytest.raises(ScenarioError) as error:
        load_scenario(path)
    third = MARK.replace("6:3: components.other", "7:3: components.third")
    expected = [MARK, third, "10:33: connections[0].to: there is no component `nobody`; "]
    found = [str(problem).removeprefix(f"{path}:") for problem in error.value.problems]
    assert len(found) == 3
    assert all(map(str.startswith, found, expected))


def test_members_of_a_family_are_refused_at_its_line(path: Path) -> None:
    path.write_text(
        "schema: 1\ntitle: A family\ntime: {stop: 1 s}\neach:\n  ego: [red, green, blue]\n"
        "components:\n  lamp: {type: lone, each: ego, step: 1 s, parameters: {holds: the lamp}}\n"
    )
    with pytest.raises(ScenarioError) as error:
        load_scenario(path)
    (problem,) = error.value.problems
    assert str(problem).startswith(f"{path}:7:3: components.lamp")
    assert "`lamp-red`" in str(problem)
    assert str(problem).endswith("(and 1 more alike)")
    path.write_text(path.read_text().replace("the lamp", "'{ego} lamp'"))
    load_scenario(path)


def test_an_experiment_whose_runs_would_be_refused_is_refused(path: Path) -> None:
    marked(path, "other", mark="on-request")
    experiment = path.with_name("experiment.yaml")
    experiment.write_text(
        "schema: 1\nscenario: two.yaml\nseeds: 1\nfactors:\n  held:\n"
        "    same: {components.free.parameters.holds: x}\nmetrics: {a: b}\n"
    )
    with pytest.raises(ScenarioError, match=r"the lamp can be in a process once"):
        load_experiment(experiment)
