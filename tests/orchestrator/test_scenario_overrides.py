"""`--set PATH=VALUE`: YAML values at any place of a scenario, and located errors."""

import json
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from orchestrator.errors import Location, Problem, ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Document
from orchestrator.scenario.overrides import apply, changed_component

DOCUMENT = "a: {b: 1, c: [x, {y: 2}]}\ncomponents: {car: {type: t}}\n"

JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.text("ab c", max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("xyz", min_size=1), inner),
    max_leaves=8,
)


def applied(*overrides: str) -> Document:
    return apply(Document.parse(DOCUMENT, "f.yaml"), overrides)


@pytest.mark.parametrize(
    ("override", "data"),
    [
        ("a.b=5", {"b": 5, "c": ["x", {"y": 2}]}),
        ("a.b=5 ms", {"b": "5 ms", "c": ["x", {"y": 2}]}),
        ('a.b="20 dBm"', {"b": "20 dBm", "c": ["x", {"y": 2}]}),
        ("a.b=x=y", {"b": "x=y", "c": ["x", {"y": 2}]}),
        ("a.c.0={z: 1}", {"b": 1, "c": [{"z": 1}, {"y": 2}]}),
        ("a.c.1.y=[3]", {"b": 1, "c": ["x", {"y": [3]}]}),
        ("a.d.e.f=1", {"b": 1, "c": ["x", {"y": 2}], "d": {"e": {"f": 1}}}),
        ("a.parameters.antenna.height=2",
         {"b": 1, "c": ["x", {"y": 2}], "parameters": {"antenna.height": 2}}),
        ("a=~", None),
    ],
)  # fmt: skip
def test_values_replace_or_add(override: str, data: object) -> None:
    assert applied(override).data["a"] == data


@given(JSON)
def test_any_value_can_be_set_and_every_part_of_it_has_a_place(value: object) -> None:
    document = applied(f"a.new={json.dumps(value)}")
    assert document.data["a"]["new"] == value
    assert all(place.value.line >= 1 for place in document.places.values())
    assert document.value(("a", "new")).file.startswith("--set ")


def test_the_last_override_of_a_place_wins() -> None:
    document = applied("a.b=2", "a={c: 1}", "a.b=3")
    assert document.data["a"] == {"c": 1, "b": 3}
    assert ("a", "c", 1, "y") not in document.places


def test_type_and_fmu_replace_each_other() -> None:
    assert applied("components.car.fmu=x.fmu").data["components"]["car"] == {"fmu": "x.fmu"}


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("a.b", "--set a.b:1:1: expected PATH=VALUE"),
        ("=3", "--set =3:1:1: `` is not a path"),
        ("a..b=3", "--set a..b=3:1:1: `a..b` is not a path"),
        ("a.b=", "--set a.b=:1:4: there is no value after `=`"),
        ("a.b={x: 1", "--set a.b={x: 1:1:10: the mapping opened with `{` in line 1 is not closed"),
        ("a.b=!x 1", "--set a.b=!x 1:1:5: the tag `!x` has no meaning here"),
        ("a.b.c=1", "--set a.b.c=1:1:5: a.b is 7, which has no `c` beneath it"),
        ("a.c.2=1", "--set a.c.2=1:1:5: `2` is not an item of a.c; items are 0 to 1"),
        ("a.c.x=1", "--set a.c.x=1:1:5: `x` is not an item of a.c"),
        (
            "components.cra.type=x",
            "--set components.cra.type=x:1:12: there is no component `cra`; did you mean `car`?",
        ),
    ],
)
def test_overrides_that_name_no_place_are_problems(override: str, message: str) -> None:
    with pytest.raises(ScenarioError) as error:
        applied("a.b=7", override, "a.c.9=1")
    assert message in str(error.value.problems[0])
    assert len(error.value.problems) == 2


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "time.stp=5s",
            "--set time.stp=5s:1:6: time: `stp` is not a key here; did you mean",
        ),
        ("time.stop=5m", "--set time.stop=5m:1:11: time.stop: expected a time (s), got a length"),
        ("components.car.parameters.pwr=5", "1:27: components.car.parameters.pwr: there is no"),
        (
            "components.car.parameters.power=99 dBm",
            "1:33: components.car.parameters.power: must",
        ),
    ],
)
def test_what_an_override_says_is_checked_like_the_file(
    scenario_file: Path, override: str, message: str
) -> None:
    with pytest.raises(ScenarioError) as error:
        load_scenario(scenario_file, [override])
    (problem,) = error.value.problems
    assert message in str(problem)


def test_keys_absent_in_the_file_can_be_set(scenario_file: Path) -> None:
    scenario = load_scenario(
        scenario_file, ["report=trace", "recording.exclude=[car.power]", "seed=9"]
    )
    assert scenario.report is not None
    assert scenario.report.type_name == "trace"
    assert (scenario.exclude, scenario.seed) == (("car.power",), 9)


def test_parameters_of_a_replaced_type_are_ignored_with_a_remark(scenario_file: Path) -> None:
    scenario = load_scenario(
        scenario_file,
        ["components.car.type=receiver", "components.car.parameters.gain=1"],
    )
    assert scenario.components["car"].values == {"gain": 1.0}
    assert [str(remark).split(":", 1)[1] for remark in scenario.remarks] == [
        f"11:{column}: components.car.parameters.{name}: "
        f"ignored, the type that was set has no `{name}`"
        for column, name in ((18, "power"), (33, "count"), (43, "noisy"))
    ]


def test_parameters_that_an_override_sets_must_exist_in_the_new_type(scenario_file: Path) -> None:
    with pytest.raises(ScenarioError, match="there is no parameter `gian`; did you mean `gain`"):
        load_scenario(
            scenario_file,
            ["components.car.type=receiver", "components.car.parameters.gian=1"],
        )


@pytest.mark.parametrize(
    ("override", "component"),
    [
        ("components.car.step=1 s", "car"),
        ("components.car.parameters.a.b=1=2", "car"),
        ("components.car={type: sender}", None),
        ("components.car.each=ego", None),
        ("components.car.each.x=ego", None),
        ("time.stop.x=1 s", None),
        ("measures.car.level=1", None),
    ],
)
def test_an_override_is_within_a_component_below_its_name(
    override: str, component: str | None
) -> None:
    assert changed_component(override) == component


def test_a_problem_is_on_one_line_whatever_the_setting_has_in_it() -> None:
    with pytest.raises(ScenarioError) as error:
        applied(".=one\r\ntwo\u2028three")
    assert str(error.value).startswith("--set .=one\\ntwo\\nthree:1:1: `.` is not a path; ")
    said = Problem(Location("f.yaml", 2, 7), 'seed: expected a whole number, got "x\ny"')
    assert str(said) == r'f.yaml:2:7: seed: expected a whole number, got "x\ny"'
