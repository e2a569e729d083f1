"""What becomes of the parameter bindings of a package."""

from pathlib import Path
from typing import Any

import pytest

from tests.adapters.ssp.packages import (
    SPACES,
    UNITS,
    component,
    connectors,
    description,
    link,
    system,
    values,
)
from tests.adapters.ssp.test_import import LINEAR, imported, problems, scenario


def parameters(folder: Path, content: str, files: Any = None, name: str = "a") -> dict[str, Any]:
    found = scenario(imported(folder, description(content), files))
    said: dict[str, Any] = found["components"][name].get("parameters", {})
    return said


def alone(*said: str, **options: str) -> str:
    """One component with a binding."""
    return system("top", component("a", "u", "k", inside=bound(values(*said, **options))))


def bound(binding: str) -> str:
    return f"<ssd:ParameterBindings>{binding}</ssd:ParameterBindings>"


def test_values_of_every_type_are_set(tmp_path: Path) -> None:
    content = alone(
        "k:Real:2.5", "gear:Enumeration:high", "on:Boolean:1", "name:String:a b", "count:Integer:7"
    )
    assert parameters(tmp_path, content) == {
        "k": 2.5, "gear": "high", "on": True, "name": "a b", "count": 7
    }  # fmt: skip


def test_an_input_gets_a_start_value(tmp_path: Path) -> None:
    assert parameters(tmp_path, alone("u:Real:3", "n:Integer:2")) == {"start.u": 3.0, "start.n": 2}


def test_values_are_converted_to_the_units_of_the_fmu(tmp_path: Path) -> None:
    said = parameters(tmp_path, alone("k:Real:36:km/h", "warm:Real:20.5:degC", units=UNITS))
    assert said == {"k": pytest.approx(10.0, rel=1e-15), "warm": 293.65}


def test_a_comment_says_where_a_value_is_from(tmp_path: Path) -> None:
    found = imported(tmp_path, description(alone("k:Real:2.5")))
    assert "      k: 2.5  # SystemStructure.ssd:4:" in found.path.read_text()


ENTRY = '<ssm:MappingEntry source="{}" target="{}" {}>{}</ssm:MappingEntry>'


@pytest.mark.parametrize(
    ("suppressed", "expected"), [("", 2 * 10.0 + 0.5), ('suppressUnitConversion="1"', 72.5)]
)
def test_a_mapping_renames_and_transforms_after_the_conversion(
    tmp_path: Path, suppressed: str, expected: float
) -> None:
    """SSP 2.0, 7.1.1: of 36 km/h, in m/s, or as it is."""
    mapping = ENTRY.format("outside", "k", suppressed, LINEAR)
    said = parameters(
        tmp_path, alone("outside:Real:36:km/h", "k:Real:9", mapping=mapping, units=UNITS)
    )
    assert said == {"k": pytest.approx(expected, rel=1e-15)}


def test_a_mapping_may_use_a_value_twice_and_leaves_others(tmp_path: Path) -> None:
    mapping = ENTRY.format("x", "k", "", "") + ENTRY.format("x", "u", "", "")
    assert parameters(tmp_path, alone("x:Real:2", "warm:Real:5", mapping=mapping)) == {
        "k": 2.0, "start.u": 2.0
    }  # fmt: skip


@pytest.mark.parametrize(
    ("value", "table", "expected"),
    [
        ("on:Boolean:true", "Boolean", False),
        ("count:Integer:4", "Integer", 9),
        ("gear:Enumeration:low", "Enumeration", "high"),
    ],
)
def test_a_mapping_takes_values_from_a_table(
    tmp_path: Path, value: str, table: str, expected: Any
) -> None:
    name, type_, text = value.split(":")
    words = str(expected).lower() if table == "Boolean" else expected
    line = f'<ssc:MapEntry source="{text}" target="{words}"/>'
    change = f"<ssc:{table}MappingTransformation>{line}</ssc:{table}MappingTransformation>"
    mapping = ENTRY.format("x", name, "", change)
    content = alone(f"x:{type_}:{text}", mapping=mapping)
    assert parameters(tmp_path, content) == {name: expected}


def test_files_beside_the_description_are_read(tmp_path: Path) -> None:
    files = {
        "resources/p.ssv": f'<ssv:ParameterSet {SPACES} version="1.0" name="p"><ssv:Parameters>\n'
        '<ssv:Parameter name="x"><ssv:Real value="4"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet>",
        "resources/p.ssm": f'<ssm:ParameterMapping {SPACES} version="1.0">'
        f"{ENTRY.format('x', 'k', '', '')}</ssm:ParameterMapping>",
    }
    binding = (
        '<ssd:ParameterBinding source="resources/p.ssv">'
        '<ssd:ParameterMapping source="resources/p.ssm"/></ssd:ParameterBinding>'
    )
    content = system("top", component("a", inside=bound(binding)))
    found = imported(tmp_path, description(content), files)
    assert "k: 4.0  # resources/p.ssv:2:" in found.path.read_text()


def test_systems_come_before_what_is_in_them_and_later_bindings_before_earlier(
    tmp_path: Path,
) -> None:
    """SSP 2.0, 5.3.2."""
    inside = bound(values("k:Real:1", "warm:Real:1", "u:Real:1", "count:Integer:1"))
    box = system("box", component("a", inside=inside), values=values("a.warm:Real:2", "a.u:Real:2"))
    top = (
        values("box.a.u:Real:3") + values("box.a.count:Integer:4") + values("box.a.count:Integer:5")
    )
    content = system("top", box, values=top)
    assert parameters(tmp_path, content, name="box-a") == {
        "k": 1.0, "warm": 2.0, "start.u": 3.0, "count": 5
    }  # fmt: skip


def test_a_prefix_stands_in_front_of_all_names(tmp_path: Path) -> None:
    content = system("top", component("a"), component("b"),
                     values=values("k:Real:2", more='prefix="a."'))  # fmt: skip
    assert parameters(tmp_path, content) == {"k": 2.0}


def test_a_name_with_two_meanings_sets_both(tmp_path: Path) -> None:
    """SSP 2.0, 5.3.2: punning."""
    content = system(
        "top", system("B", component("C")), component("B.C"), values=values("B.C.k:Real:2")
    )
    found = scenario(imported(tmp_path, description(content)))["components"]
    assert [each["parameters"] for each in found.values()] == [{"k": 2.0}, {"k": 2.0}]


def test_a_value_of_a_connector_goes_where_the_connector_leads(tmp_path: Path) -> None:
    """Of 36 km/h at a connector in mm/s, 10000 mm/s go on; doubled in m/s, with an offset."""
    ports = connectors("p:parameter:Real mm/s", "i:input")
    box = system("box", component("a", "k", "v"), ports=ports,
                 links=link(".p", "a.k", LINEAR) + link(".i", "a.v"))  # fmt: skip
    content = system("top", box, values=values("box.p:Real:36:km/h", "box.i:Real:7", units=UNITS))
    assert parameters(tmp_path, content, name="box-a") == {
        "k": pytest.approx(20.5, rel=1e-15), "start.v": 7.0
    }  # fmt: skip


def test_what_has_no_name_here_is_remarked_on(tmp_path: Path) -> None:
    mapping = ENTRY.format("nothing", "k", "", "") + ENTRY.format("", "u", "", "")
    content = system("top", component("a", inside=bound(values("q:Real:1", "k:Real:2"))),
                     component("b", inside=bound(values("k:Real:2", mapping=mapping))))  # fmt: skip
    said = [each.what for each in imported(tmp_path, description(content)).remarks]
    assert said == [
        "`q` sets nothing: there is nothing of this name",
        "maps `nothing`, which the parameter set does not have",
        "left out: lines of a mapping that name no source",
    ]


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ("k:String:x", "`a.k`: its type is Real, the value is of the type String"),
        ("k:Real:one", "`a.k`: expected a number, got `one`"),
        ("k:Real:1e999", "`a.k`: expected a finite number, got `1e999`"),
        ("k:Real:2:degC", "`a.k`: units differ: degC and m/s"),
        ("count:Real:2.5", "`a.count`: expected a whole number, got 2.5"),
        ("gear:Enumeration:hihg", "`a.gear`: no item `hihg`; did you mean `high`?"),
        ("gear:Integer:3", "`a.gear`: expected one of low, high"),
        ("on:Boolean:yes", "`a.on`: expected true or false, got `yes`"),
        ("y:Real:1", "`a.y` cannot be set: causality output, type Real"),
        ("k:Real:1 2", "`k` has 2 values and no `Dimension`"),
    ],
)
def test_what_a_value_cannot_be_is_told_where_it_is(
    tmp_path: Path, said: str, problem: str
) -> None:
    (found,) = problems(tmp_path, description(alone(said, units=UNITS)))
    assert found.startswith("test.ssp/SystemStructure.ssd:4:")
    assert found.endswith(problem)


@pytest.mark.parametrize(
    ("binding", "problem"),
    [
        ('<ssd:ParameterBinding source="resources/q.ssv"/>', "there is no `resources/q.ssv`"),
        ('<ssd:ParameterBinding source="https://example.org/q.ssv"/>', "leads out of the package"),
        ('<ssd:ParameterBinding source="q.ssv" sourceBase="component"/>', "`sourceBase`: files"),
        ('<ssd:ParameterBinding type="text/csv" source="q.csv"/>', "`text/csv` is not supported"),
        ("<ssd:ParameterBinding/>", "neither `source` nor `ssv:ParameterSet`"),
        (values("k:Real:1", "k:Real:2"), "`k` has another value in line 4"),
        (
            values("x:Real:1", "x:Real:1:K", mapping=ENTRY.format("x", "k", "", "")),
            "`k` has another value in line 4",
        ),
        (
            values("x:Boolean:1", mapping=ENTRY.format("x", "on", "", LINEAR)),
            "a linear transformation takes a number, not a Boolean",
        ),
        (
            values("x:Real:1", mapping=ENTRY.format("x", "k", "", "") * 2),
            "`k` has a source already: `x`",
        ),
    ],
)
def test_bindings_that_cannot_be_read_are_refused(
    tmp_path: Path, binding: str, problem: str
) -> None:
    content = system("top", component("a", inside=bound(binding)))
    assert any(problem in each for each in problems(tmp_path, description(content)))


def test_names_with_several_values_do_no_harm_where_they_set_nothing_or_are_equal(
    tmp_path: Path,
) -> None:
    many = [f"q{n % 6}:Real:{n}" for n in range(12)]
    content = system(
        "top", component("a", inside=bound(values("warm:Real:1:K", *many, "warm:Real:1:K")))
    )
    found = imported(tmp_path, description(content))
    assert [each.what for each in found.remarks] == [
        "`q0`, `q1`, `q2`, `q3`, `q4` and 1 more set nothing: there is nothing of this name"
    ]


def test_a_parameter_that_cannot_be_set_is_a_problem(tmp_path: Path) -> None:
    (found,) = problems(tmp_path, description(alone("inner:Real:1")))
    assert found.endswith("`a.inner` cannot be set: causality local, type Real")
