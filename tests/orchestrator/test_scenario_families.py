"""Families: what is said once for each ego is the same as what is written out for all."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.recording.reader import Recording
from orchestrator.scenario import reference
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Document
from orchestrator.scenario.expansion import expanded
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.wiring import assemble

FAMILY = """\
schema: 1
title: Three egos
time: {stop: 1 s, until: road.over}
coupling:
  order: [road, driver, guide]
each:
  ego: [red, green, blue]
components:
  road:
    type: road
    step: 50 ms
    parameters: {egos: ["{ego}"]}
  driver:
    type: driver
    each: ego
    step: 100 ms
    process: on-request
    parameters: {gain: 0.5, plate: "the {ego} one"}
  guide:
    type: driver
    each: ego
    step: 100 ms
connections:
  - {from: "road.{ego}", to: driver.ego}
  - {from: road.limit, to: driver.limit}
  - {from: guide.command, to: driver.wish}
  - {from: driver.command, to: "road.{ego}.command"}
recording:
  include: [driver.*, "road.{ego}.position", guide-red.command]
  exclude: ["driver-{ego}.wish", driver.nothing*]
measures:
  far: {type: span, signal: "road.{ego}.position"}
  span: {signal: "driver-{ego}.command"}
"""

WRITTEN = """\
schema: 1
title: Three egos
time: {stop: 1 s, until: road.over}
coupling:
  order:
    [road, driver-red, driver-green, driver-blue, guide-red, guide-green, guide-blue]
components:
  road: {type: road, step: 50 ms, parameters: {egos: [red, green, blue]}}
  driver-red:
    {type: driver, step: 100 ms, process: on-request, parameters: {gain: 0.5, plate: the red one}}
  driver-green:
    {type: driver, step: 100 ms, process: on-request, parameters: {gain: 0.5, plate: the green one}}
  driver-blue:
    {type: driver, step: 100 ms, process: on-request, parameters: {gain: 0.5, plate: the blue one}}
  guide-red: {type: driver, step: 100 ms}
  guide-green: {type: driver, step: 100 ms}
  guide-blue: {type: driver, step: 100 ms}
connections:
  - {from: road.red, to: driver-red.ego}
  - {from: road.green, to: driver-green.ego}
  - {from: road.blue, to: driver-blue.ego}
  - {from: road.limit, to: driver-red.limit}
  - {from: road.limit, to: driver-green.limit}
  - {from: road.limit, to: driver-blue.limit}
  - {from: guide-red.command, to: driver-red.wish}
  - {from: guide-green.command, to: driver-green.wish}
  - {from: guide-blue.command, to: driver-blue.wish}
  - {from: driver-red.command, to: road.red.command}
  - {from: driver-green.command, to: road.green.command}
  - {from: driver-blue.command, to: road.blue.command}
recording:
  include:
    [driver-red.*, driver-green.*, driver-blue.*, road.red.position, road.green.position,
     road.blue.position, guide-red.command]
  exclude:
    [driver-red.wish, driver-green.wish, driver-blue.wish, driver-red.nothing*,
     driver-green.nothing*, driver-blue.nothing*]
measures:
  far-red: {type: span, signal: road.red.position}
  far-green: {type: span, signal: road.green.position}
  far-blue: {type: span, signal: road.blue.position}
  span-red: {type: span, signal: driver-red.command}
  span-green: {type: span, signal: driver-green.command}
  span-blue: {type: span, signal: driver-blue.command}
"""

Fingerprint = Callable[..., dict[str, Any]]


@pytest.fixture
def family(tmp_path: Path, sample_units: None) -> Path:
    """A scenario with a family of three."""
    path = tmp_path / "egos.yaml"
    path.write_text(FAMILY)
    return path


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Fingerprint:
    """Run a scenario and read its JSON object."""

    def run(path: Path, *options: str) -> dict[str, Any]:
        out = str(tmp_path / f"out-{len(list(tmp_path.iterdir()))}")
        assert main(["run", str(path), "--out", out, "--json", "--quiet", *options]) == 0
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    return run


def write(path: Path, *changes: tuple[str, str]) -> Path:
    """Replace text in the file."""
    text = path.read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text)
    return path


def problems(path: Path, *overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        load_scenario(path, overrides)
    return [str(problem).removeprefix(f"{path.parent}/") for problem in error.value.problems]


def connections(path: Path, *overrides: str) -> list[str]:
    return [f"{c.source} > {c.target}" for c in load_scenario(path, overrides).connections]


def test_a_family_is_what_it_would_be_written_out(family: Path) -> None:
    written = family.with_name("written.yaml")
    written.write_text(WRITTEN)
    assert load_scenario(family).resolved() == load_scenario(written).resolved()
    assert load_scenario(family).remarks == ()


@pytest.mark.parametrize("transport", ["in-process", "loopback"])
def test_it_gives_the_bytes_of_what_is_written_out(
    family: Path, run: Fingerprint, transport: str
) -> None:
    written = family.with_name("written.yaml")
    written.write_text(WRITTEN)
    first, second = (run(path, "--transport", transport) for path in (family, written))
    assert first["fingerprint"] == second["fingerprint"]
    assert first["metrics"] == second["metrics"]
    far = first["metrics"]["measures"]
    assert far["far-red"] != far["far-green"]
    assert first["fingerprint"] == run(family)["fingerprint"]


def test_another_member_changes_the_draws_of_nobody(family: Path, run: Fingerprint) -> None:
    """All egos meet in `road.limit` only; without it, each has the same bytes in any company."""

    names = [f"driver-{member}.command" for member in ("red", "green")]
    names += [f"road.{member}.position" for member in ("red", "green")]

    def signals(members: str) -> dict[str, bytes]:
        recording = Recording(Path(run(family, "--set", f"each.ego={members}")["out"]))
        return {name: recording[name].values.tobytes() for name in names}

    write(family, ("  - {from: road.limit, to: driver.limit}\n", ""))
    write(family, (", guide-red.command]", "]"))
    two, three = signals("[green, red]"), signals("[blue, red, green]")
    assert two == three
    assert two["driver-red.command"] != two["driver-green.command"]


def test_the_members_can_be_set_and_be_of_another_file(family: Path) -> None:
    one = load_scenario(family, ["each.ego=[red]"])
    assert list(one.components) == ["road", "driver-red", "guide-red"]
    over = family.with_name("over.yaml")
    over.write_text("schema: 1\nextends: egos.yaml\neach: {ego: [red, grey]}\n")
    assert list(load_scenario(over).components)[1:3] == ["driver-red", "driver-grey"]
    over.write_text("schema: 1\nextends: egos.yaml\neach: {lane: [left]}\n")
    (remark,) = load_scenario(over).remarks
    assert str(remark).endswith(
        "over.yaml:3:8: each.lane: no component and no `{lane}` uses this family"
    )


def test_all_members_or_one_can_be_set(family: Path) -> None:
    overrides = [
        "components.driver-green.parameters.gain=3",
        "components.driver.parameters.gain=2",
        "components.driver-blue.process=false",
    ]
    for order in (overrides, overrides[::-1]):
        components = load_scenario(family, order).components
        gains = {n: c.values["gain"] for n, c in components.items() if n.startswith("driver")}
        assert gains == {"driver-red": 2, "driver-green": 3, "driver-blue": 2}
        assert [components[f"driver-{m}"].process for m in ("red", "blue")] == [
            Isolation.ON_REQUEST,
            Isolation.NEVER,
        ]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("components.driver-grey.parameters.gain=3", ":1:12: there is no component `driver-grey`"),
        ("components.driver-red.each=ego", ":1:12: there is no component `driver-red`"),
        ("components.driver-red.parameters.gian=3", ".gian: there is no parameter `gian`; did you"),
        ("components.driver-red.stp=3", ":1:23: components.driver-red: `stp` is not a key here"),
        ("components.driver.parameters.gian=3", "components.driver.parameters.gian: there is no"),
        ("connections.4.to=road.x", ":1:13: `4` is not an item of connections; items are 0 to 3"),
    ],
)
def test_settings_of_one_member_are_checked(family: Path, override: str, message: str) -> None:
    (problem,) = problems(family, override)
    assert problem.startswith(f"--set {override}:")
    assert message in problem


def test_two_families_make_every_pair(family: Path) -> None:
    write(family, ("  ego: [red", "  wheel: [l, r]\n  ego: [red"))
    write(family, ('egos: ["{ego}"]', 'egos: ["{ego}", "{ego}{wheel}"]'))
    write(
        family,
        (
            "connections:",
            'connections:\n  - {from: "driver.command", to: "road.{ego}{wheel}.command"}',
        ),
    )
    assert load_scenario(family).components["road"].values["egos"] == (
        "red", "green", "blue", "redl", "redr", "greenl", "greenr", "bluel", "bluer",
    )  # fmt: skip
    assert connections(family)[:3] == [
        "driver-red.command > road.redl.command",
        "driver-red.command > road.redr.command",
        "driver-green.command > road.greenl.command",
    ]


def test_one_member_can_be_named(family: Path) -> None:
    write(family, ("connections:", "connections:\n  - {from: road.limit, to: guide-red.limit}"))
    write(
        family, ("connections:", 'connections:\n  - {from: "driver-{ego}.command", to: guide.wish}')
    )
    found = connections(family)
    assert found[:4] == [
        "driver-red.command > guide-red.wish",
        "driver-green.command > guide-green.wish",
        "driver-blue.command > guide-blue.wish",
        "road.limit > guide-red.limit",
    ]


def test_a_family_of_one_may_drive_a_single_input_and_end_the_run(family: Path) -> None:
    write(family, ("until: road.over", 'until: "road.{ego}.over"'))
    write(family, ('to: "road.{ego}.command"', "to: road.red.command"))
    write(family, ('egos: ["{ego}"]', 'egos: ["{ego}"], caption: "only {ego}"'))
    scenario = load_scenario(family, ["each.ego=[red]"])
    assert str(scenario.until) == "road.red.over"
    assert scenario.components["road"].values["caption"] == "only red"
    assert connections(family, "each.ego=[red]")[-1] == "driver-red.command > road.red.command"
    assert len(problems(family)) == 3


def mistakes() -> Iterator[tuple[str, str, str]]:
    """Old text, new text and message of each entry of `family_problems.txt`."""
    text = Path(__file__).with_name("family_problems.txt").read_text()
    for block in text.strip().split("\n\n")[1:]:
        *change, message = block.split("\n")
        old, new = ("\n".join(row[2:] for row in change if row[0] == sign) for sign in "-+")
        yield old, new, message


@pytest.mark.parametrize(("old", "new", "message"), list(mistakes()))
def test_a_problem_is_located_and_said_once(
    family: Path, old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write(family, (old, new))
    assert main(["check", str(family)]) == 2
    found = capsys.readouterr().out.replace(f"{family.parent}/", "").splitlines()
    assert [line for line in found if line.startswith(message)], found
    assert len(found) == 1, found


def test_all_problems_are_reported_at_once(family: Path) -> None:
    found = problems(
        write(
            family,
            ("[red, green, blue]", "[red, green, red]"),
            ("stop: 1 s", "stop: soon"),
            ("driver:\n    type: driver\n    each: ego", "driver:\n    type: driver\n    each: eg"),
            ("gain: 0.5", "gain: -1"),
            ("road.limit", '"road.{egg}"'),
        )
    )
    assert [problem.split(": ", 1)[0] for problem in found] == [
        "egos.yaml:3:14", "egos.yaml:7:21", "egos.yaml:15:11", "egos.yaml:18:24",
        "egos.yaml:25:12",
    ]  # fmt: skip


def test_the_example_of_the_reference_is_written_out_as_it_says() -> None:
    page = Path(__file__).parents[2] / reference.REFERENCE_FILE
    before, after, *_ = re.findall(
        r"```yaml\n(.*?)```", page.read_text().split("## Families")[1], re.S
    )
    found = expanded(Document.parse(before, "f.yaml"))
    assert (found.problems, found.remarks) == ((), ())
    assert found.document.data == Document.parse(after, "f.yaml").data


def test_an_experiment_varies_the_members(family: Path, tmp_path: Path) -> None:
    experiment = tmp_path / "experiment.yaml"
    experiment.write_text(
        "schema: 1\nscenario: egos.yaml\nseeds: 1\n"
        "set: {measures: {far: {type: span, signal: road.red.position}}}\n"
        "factors:\n  egos:\n    one: {each.ego: [red]}\n    two: {each.ego: [red, green]}\n"
        "metrics: {far: far.span}\n"
    )
    found = load_experiment(experiment)
    names = [list(c.resolved["components"]) for c in found.combinations]
    assert names == [
        ["road", "driver-red", "guide-red"],
        ["road", "driver-red", "driver-green", "guide-red", "guide-green"],
    ]


def test_the_graph_shows_the_instances(family: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drawing = family.with_name("graph.svg")
    assert main(["graph", str(family), "--json", "--svg", str(drawing)]) == 0
    graph = json.loads(capsys.readouterr().out)
    ends = [(each["from"], each["to"]) for each in graph["connections"]]
    assert ("driver-blue", "road") in ends
    assert ("guide-blue", "driver-blue") in ends
    assert ("guide-blue", "driver-red") not in ends
    assert [each["entry"] for each in graph["components"]][:4] == ["road", *["driver"] * 3]
    root = ET.fromstring(drawing.read_text())  # noqa: S314 - our own file
    texts = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"road", "driver \u00d7 3", "guide \u00d7 3"} <= texts
    labels = [e.findtext("{*}title") for e in root.iterfind("{*}text[@class='label']")]
    assert labels == [
        "red.id -> ego.id, red.position -> ego.position, limit -> limit",
        "command -> wish",
        "command -> red.command",
    ]


def test_the_same_sentence_of_all_members_is_said_once_when_assembled(family: Path) -> None:
    write(family, ("from: guide.command", "from: guide.message"))
    with pytest.raises(ScenarioError) as error:
        assemble(load_scenario(family))
    (problem,) = error.value.problems
    assert problem.where.line == 26
    assert "`guide-red.message` to `driver-red.wish`" in problem.what
    assert problem.what.endswith("(and 2 more alike)")


def test_sums_and_constants_are_repeated_for_each_member(
    tmp_path: Path, sample_units: None
) -> None:
    path = tmp_path / "several.yaml"
    path.write_text(
        "schema: 1\n"
        "title: Several\n"
        "time: {stop: 1 s}\n"
        "each: {ego: [first, second]}\n"
        "components:\n"
        "  a: {type: counting, step: 100 ms}\n"
        "  b: {type: keeping, each: ego, step: 100 ms}\n"
        "connections:\n"
        "  - {sum: [a.n, {from: 'b.y[0]', gain: 2}], to: b.v}\n"
        "  - {value: 3, to: 'b.u[0]'}\n"
    )
    scenario = load_scenario(path)
    ends = [(each.source, each.target, each.way.gain) for each in scenario.connections]
    assert ends == [
        (source, f"b-{member}.v", gain)
        for member in ("first", "second")
        for source, gain in (("a.n", 1.0), (f"b-{member}.y[0]", 2))
    ]
    assert [each.target for each in scenario.constants] == ["b-first.u[0]", "b-second.u[0]"]
    path.write_text(path.read_text().replace("to: b.v", "to: c.v"))
    with pytest.raises(ScenarioError, match=r"connections\[0\].to: `b.y\[0\]` is 2 outputs, and"):
        load_scenario(path)
