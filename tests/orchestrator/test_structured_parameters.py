"""Records, records by name, lists of records and distributions as parameters of a component."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from orchestrator import registry
from orchestrator.cli import main
from orchestrator.distribution import (
    Choice,
    Constant,
    DistributedText,
    Distribution,
    Normal,
    Uniform,
)
from orchestrator.errors import ScenarioError
from orchestrator.kinds import FILE_OR_NAME, FrozenMapping
from orchestrator.parameters import REQUIRED, Parameter
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.kind_names import kind_name
from orchestrator.scenario.values import convert, written
from tests.installation import install
from tests.orchestrator.files import problems_after
from tests.orchestrator.packages.structured_units import Entity, Start, Stop

SCENARIO = """\
schema: 1
title: An encounter
time: {stop: 1 s}
components:
  traffic:
    type: encounter
    step: 100 ms
    process: on-request
    parameters:
      entities:
        ego:
          role: ego
          speed: 36 km/h
          start: {lane: north, position: 20 m}
        collider:
          speed: {uniform: [18 km/h, 36 km/h]}
          kind: {choice: [car, truck]}
        gone: null
      stops:
        - after: 500 ms
        - {after: 2, level: 1 mW}
"""


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario with a component that has structured parameters."""
    monkeypatch.syspath_prepend(Path(__file__).parents[2])
    unit = "tests.orchestrator.packages.structured_units:Encounter"
    install(monkeypatch, {registry.COMPONENTS: {"encounter": unit}})
    path = tmp_path / "encounter.yaml"
    path.write_text(SCENARIO)
    return path


def values(path: Path, *overrides: str) -> Mapping[str, Any]:
    return load_scenario(path, overrides).components["traffic"].values


def problems(path: Path, *changes: tuple[str, str]) -> list[str]:
    """The problems after replacing text in the file, without its name and the address before."""
    short = "components.traffic.parameters."
    found = problems_after(path, *changes)
    return [str(each).removeprefix(f"{path}:").replace(short, "") for each in found]


def test_a_component_receives_records_in_the_order_of_the_file(path: Path) -> None:
    received = values(path)
    assert list(received["entities"]) == ["ego", "collider", "gone"]
    assert received["entities"] == {
        "ego": Entity(role="ego", speed=Constant(10.0), start=Start(lane="north", position=20.0)),
        "collider": Entity(speed=Uniform(5.0, 10.0), kind=DistributedText(("car", "truck"))),
        "gone": None,
    }
    assert received["stops"] == (Stop(after=0.5), Stop(after=2.0, level=0.0))
    with pytest.raises(TypeError):
        received["entities"]["ego"] = None
    assert hash(received["entities"]) == hash(FrozenMapping(dict(received["entities"])))


def test_all_problems_are_reported_at_once_each_at_its_place(path: Path) -> None:
    found = problems(
        path,
        ("          role: ego", "          rol: ego"),
        ("speed: 36 km/h", "speed: 300 km/h"),
        ("lane: north, ", ""),
        ("[18 km/h, 36 km/h]", "[18 km/h, 36 kg]"),
        ("choice: [car", "chioce: [car"),
        ("gone: null", "gone!: null"),
        ("- after: 500 ms", "- level: 3 dBm"),
        ("level: 1 mW", "level: 1 m"),
    )
    assert found == [
        "12:11: entities.ego.rol: there is no parameter `rol`; did you mean `role`?",
        '13:18: entities.ego.speed: must be at most 50 m/s, got 83.3333 m/s ("300 km/h")',
        "14:11: entities.ego.start: the parameter `lane` is missing: text, of the road network",
        (
            '16:38: entities.collider.speed.uniform[1]: "36 kg": expected a speed (m/s), '
            "got a mass (kg); for example `8.5 m/s`"
        ),
        (
            "17:18: entities.collider.kind.chioce: there is no distribution `chioce`; "
            "did you mean `choice`?"
        ),
        (
            "18:9: entities.gone!: `gone!` cannot be a name; write letters, digits, `_` and `-` "
            "(not first)"
        ),
        "20:11: stops[0]: the parameter `after` is missing: number [s], from its beginning",
        (
            '21:29: stops[1].level: "1 m": expected a power (dBm), got a length (m); '
            "for example `0 dBm`"
        ),
    ]


BOUNDS = "[18 km/h, 36 km/h]"
UNIFORM = f"uniform: {BOUNDS}"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("gone: null", "gone: 5", "18:15: entities.gone: expected a mapping of `key: value` lines"),
        ("gone: null", "choice: null", "`choice` cannot be a name; it is the word for a distri"),
        ("  stops:\n", "  limits:\n", "20:9: limits: expected a mapping of names"),
        ("{choice: [car, truck]}", "{choice: []}", "kind.choice: there is nothing to choose from"),
        ("role: ego", "role: ego\n          kind: {choice: [a, b]}", "11:9: entities.ego: the"),
        (BOUNDS, "[36 km/h, 18 km/h]", "16:19: entities.collider.speed.uniform: the lo"),
        (BOUNDS, "[36 km/h]", "expected two bounds, got 1; write `[low, high]`"),
        (BOUNDS, "3", "expected a list, got 3"),
        (f"{{{UNIFORM}}}", "[1, 2]", "a number or a distribution, got a list; write"),
        (f"{{{UNIFORM}}}", "{}", "expected one distribution, got 0; write `{unif"),
        (UNIFORM, "normal: 3", "write `{mean: ..., deviation: ...}`"),
        (UNIFORM, "normal: {mean: 3}", "the parameter `deviation` is missing"),
        (UNIFORM, "normal: {mean: 3, deviation: 0}", "0 is not positive"),
        (UNIFORM, "normal: {mean: 3, deviation: 1, high: 0}", "too little"),
        (UNIFORM, "choice: [1, 60]", "speed.choice[1]: must be at most 50"),
        (UNIFORM, "choice: {values: [1], weights: [0]}", "must be positive"),
        (UNIFORM, "choice: {values: [1], weights: [1, 2]}", "2 weights do"),
    ],
)  # fmt: skip
def test_a_mistake_is_located_and_says_what_to_write(
    path: Path, old: str, new: str, message: str
) -> None:
    (found,) = problems(path, (old, new))
    assert message in found


def test_overrides_reach_into_parameters(path: Path) -> None:
    received = values(
        path,
        "components.traffic.parameters.entities.ego.speed=25.2 km/h",
        "components.traffic.parameters.entities.collider=null",
        "components.traffic.parameters.entities.third.start.lane=south",
        "components.traffic.parameters.stops.0.after=3 s",
        "components.traffic.parameters.origin.lane=b",
    )
    assert received["entities"]["ego"].speed == Constant(7.0)
    assert received["entities"]["collider"] is None
    assert received["entities"]["third"] == Entity(start=Start(lane="south"))
    assert received["stops"][0] == Stop(after=3.0)
    assert received["origin"] == Start(lane="b")


def test_an_override_of_no_parameter_is_located(path: Path) -> None:
    override = "components.traffic.parameters.entities.ego.sped=3"
    with pytest.raises(ScenarioError) as error:
        load_scenario(path, [override])
    (problem,) = error.value.problems
    assert str(problem) == (
        f"--set {override}:1:44: components.traffic.parameters.entities.ego.sped: "
        "there is no parameter `sped`; did you mean `speed`?"
    )


def test_a_file_that_extends_another_changes_what_it_says(path: Path) -> None:
    other = path.with_name("other.yaml")
    other.write_text(
        "schema: 1\nextends: encounter.yaml\ncomponents:\n  traffic:\n    parameters:\n"
        "      entities:\n        ego: null\n        gone: {role: ego}\n        collider:\n"
        "          speed: {normal: {mean: 6, deviation: 1}}\n          files: [other.yaml]\n"
    )
    received = values(other)
    assert received["entities"] == {
        "ego": None,
        "collider": Entity(
            speed=Normal(6.0, 1.0, 0.0, 50.0),
            kind=DistributedText(("car", "truck")),
            files=(other,),
        ),
        "gone": Entity(role="ego"),
    }
    assert len(received["stops"]) == 2
    other.write_text(other.read_text().replace("mean", "maen"))
    with pytest.raises(ScenarioError) as error:
        load_scenario(other)
    assert [p.where.line for p in error.value.problems] == [10, 10]
    assert {p.where.file for p in error.value.problems} == {str(other)}


def test_a_resolved_scenario_means_the_same_when_read_again(path: Path, tmp_path: Path) -> None:
    first = load_scenario(path, ["components.traffic.parameters.temperature={uniform: [2, 300 K]}"])
    (tmp_path / "again").mkdir()
    again = tmp_path / "again" / "resolved.yaml"
    again.write_text(json.dumps(first.resolved()))
    read = load_scenario(again)
    both = [s.components["traffic"].all_values() for s in (first, read)]
    assert both[0] == both[1]
    assert list(both[0]["entities"]) == list(both[1]["entities"])
    assert read.resolved() == first.resolved()


def test_another_process_receives_the_same_parameters(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fingerprints = []
    for transport in ("in-process", "loopback"):
        out = tmp_path / transport
        arguments = ["run", str(path), "--transport", transport, "--out", str(out), "--json"]
        assert main(arguments) == 0
        fingerprints.append(json.loads(capsys.readouterr().out)["fingerprint"])
    assert fingerprints[0] == fingerprints[1]


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers in the range of quantities: none is nearly zero."""
    return st.floats(low, high).map(lambda number: number if abs(number) > 1e-100 else 0.0)


NUMBERS = floats(-1e6, 1e6)
SPEEDS = floats(0, 50)
TEXTS = st.text("ab c-1", max_size=5)
WEIGHTS = st.floats(1e-3, 1e3)


def test_components_shows_records_beneath_their_parameters(
    path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")  # a line each
    assert main(["components", "encounter"]) == 0
    rows = [re.split(r" {2,}", line) for line in capsys.readouterr().out.splitlines()]
    tree = [tuple(row) for row in rows]
    assert ("", "Entity:", "Somebody who takes part.") in tree
    assert ("", "speed", "number or distribution", "= 8.5 m/s", "0 .. 50", "at the start") in tree
    assert ("", "after", "number", "required", ">= 0 s", "from its beginning") in tree
    assert ("", "origin", "Start", "= {lane: a, position: 0.0 m}", "of all places") in tree
    assert main(["components", "encounter", "--json"]) == 0
    described = json.loads(capsys.readouterr().out)["parameters"]["entities"]
    assert described["type"] == "Entity or null, by name"
    assert described["record"]["description"] == "Somebody who takes part."
    start = described["record"]["parameters"]["start"]["record"]["parameters"]
    assert start["position"]["unit"] == "m"
    assert start["lane"]["required"]


@st.composite
def choices(draw: st.DrawFn, kind: Any, items: st.SearchStrategy[Any]) -> Any:
    found = draw(st.lists(items, min_size=1, max_size=4))
    weighted = draw(st.booleans())
    lists = st.lists(WEIGHTS, min_size=len(found), max_size=len(found))
    return kind(tuple(found), tuple(draw(lists)) if weighted else ())


def uniforms(items: st.SearchStrategy[float]) -> st.SearchStrategy[Uniform]:
    return st.tuples(items, items).map(lambda pair: Uniform(*sorted(pair)))


def bounded(mean: float, deviation: float, below: float, above: float) -> Normal:
    """A normal distribution with bounds some deviations below and above its mean."""
    low, high = mean - below * deviation, mean + above * deviation
    return Normal(mean, deviation, max(low, 0.0), min(high, 50.0))


DISTRIBUTIONS = st.one_of(
    SPEEDS.map(Constant),
    uniforms(SPEEDS),
    st.builds(bounded, SPEEDS, st.floats(0.1, 20), st.floats(0.1, 3), st.floats(0.1, 3)),
    choices(Choice, SPEEDS),
)  # fmt: skip
STARTS = st.builds(Start, lane=TEXTS, position=floats(0, 1e6))
ENTITIES = st.builds(
    Entity, speed=DISTRIBUTIONS, kind=choices(DistributedText, TEXTS), start=st.none() | STARTS
)
NAMES = st.from_regex(r"\A[A-Za-z0-9_][A-Za-z0-9_-]{0,4}\Z")
ENTITY_MAPPINGS = st.dictionaries(NAMES, st.none() | ENTITIES, max_size=3).map(FrozenMapping)


@given(ENTITY_MAPPINGS)
def test_what_is_written_is_read_again(entities: FrozenMapping[Entity | None]) -> None:
    parameter = Parameter(type=Mapping[str, Entity | None], default=REQUIRED)
    text = json.dumps(written(parameter, entities))
    again = convert(parameter, json.loads(text), Path())
    assert again == entities
    assert list(again) == list(entities)


@given(st.lists(st.builds(Stop, after=floats(0, 1e6), level=NUMBERS), max_size=3).map(tuple))
def test_lists_of_records_are_read_again(stops: tuple[Stop, ...]) -> None:
    parameter = Parameter(type=tuple[Stop, ...], default=REQUIRED)
    assert convert(parameter, json.loads(json.dumps(written(parameter, stops))), Path()) == stops


@pytest.mark.parametrize("unit", ["dBm", "degC", "km/h", "1"])
@given(st.one_of(NUMBERS.map(Constant), uniforms(NUMBERS),
                 st.builds(Normal, NUMBERS, st.floats(0.1, 10))))  # fmt: skip
def test_distributions_are_read_again_in_any_unit(unit: str, distribution: Distribution) -> None:
    parameter = Parameter(type=Distribution, unit=unit, default=REQUIRED)
    said = json.loads(json.dumps(written(parameter, distribution)))
    assert convert(parameter, said, Path()) == distribution


def test_the_deviation_of_a_level_is_in_decibels() -> None:
    parameter = Parameter(type=Distribution, unit="dBm", default=REQUIRED)
    said = {"normal": {"mean": "100 mW", "deviation": "3 dB"}}
    assert convert(parameter, said, Path()) == Normal(20.0, 3.0)


@pytest.mark.parametrize("name", ["bev-32", "bev_32", "", "a b"])
def test_a_text_without_folder_and_suffix_is_a_name(tmp_path: Path, name: str) -> None:
    """Even where there is a file of that name."""
    parameter = Parameter(type=FILE_OR_NAME, default=REQUIRED)
    (tmp_path / "bev-32").touch()
    assert convert(parameter, name, tmp_path) == name
    assert written(parameter, name) == name


def test_any_other_is_a_path_beside_the_file_that_says_it(tmp_path: Path) -> None:
    parameter = Parameter(type=FILE_OR_NAME, default=REQUIRED)
    (tmp_path / "nets").mkdir()
    for text in ("mine.net", "./mine", "nets/mine", str(tmp_path / "mine.net")):
        path = tmp_path / text
        path.touch()
        found = convert(parameter, text, tmp_path)
        assert found == path.absolute()
        assert convert(parameter, written(parameter, found), Path()) == found
    with pytest.raises(ValueError, match=r"there is no file .*/nets/yours \(paths are relative"):
        convert(parameter, "nets/yours", tmp_path)
    with pytest.raises(ValueError, match="expected text, got 5"):
        convert(parameter, 5, tmp_path)
    optional = Parameter(type=str | Path | None, default=None)
    assert convert(optional, None, tmp_path) is None
    assert convert(optional, "./mine", tmp_path) == tmp_path / "mine"


def test_a_name_is_one_of_those_that_are_known(tmp_path: Path) -> None:
    """A path is none, whatever it is called; the empty name is offered to nobody."""
    parameter = Parameter(
        type=FILE_OR_NAME, default=REQUIRED, names=lambda: ("", "bev-16", "bev-32", "blind")
    )
    for name in ("bev-32", "blind", ""):
        assert convert(parameter, name, tmp_path) == name
    (tmp_path / "else").touch()
    assert convert(parameter, "./else", tmp_path) == tmp_path / "else"
    for name, hint in (("bev-23", "did you mean `bev-32`?"), ("else", "there are: bev-16, ")):
        what = f"there is no `{name}`, and a path has a folder or a suffix; {hint}"
        with pytest.raises(ValueError, match=re.escape(what)):
            convert(parameter, name, tmp_path)
    nobody = Parameter(type=FILE_OR_NAME, default=REQUIRED, names=lambda: ())
    with pytest.raises(ValueError, match="there are none"):
        convert(nobody, "bev-32", tmp_path)


def test_its_type_has_a_name_for_people() -> None:
    assert kind_name(FILE_OR_NAME) == "name or path"
    assert kind_name(tuple[str | Path, ...]) == "list of name or path"
    assert kind_name(str | Path | None) == "name or path or null"
