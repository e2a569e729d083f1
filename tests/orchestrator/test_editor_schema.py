"""The schema for editors is a schema, and takes and refuses what loading takes and refuses."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]
from jsonschema.exceptions import best_match  # type: ignore[import-untyped]

from orchestrator import registry
from orchestrator.cli import main
from orchestrator.kinds import FrozenMapping
from orchestrator.parameters import REQUIRED, Parameter, parameter
from orchestrator.scenario.document import Document
from orchestrator.scenario.editor_schema import installed_schema
from orchestrator.scenario.parameter_schema import ParameterSchemas
from orchestrator.scenario.values import written
from tests.installation import install
from tests.orchestrator.packages.structured_units import Entity
from tests.orchestrator.test_structured_parameters import ENTITY_MAPPINGS, SCENARIO

ROOT = Path(__file__).parents[2]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    """The schema with all that is installed here."""
    schema = installed_schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.fixture
def encounters(monkeypatch: pytest.MonkeyPatch) -> Draft202012Validator:
    """The schema of an installation with structured parameters."""
    monkeypatch.syspath_prepend(ROOT)
    unit = "tests.orchestrator.packages.structured_units:Encounter"
    install(
        monkeypatch, {registry.COMPONENTS: {"encounter": unit, "broken": "no_such_module:Type"}}
    )
    schema = installed_schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def problem(validator: Draft202012Validator, *changes: tuple[str, str]) -> str | None:
    """The place of the problem after replacing text in the scenario, as an editor shows it."""
    text = SCENARIO
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    error = best_match(validator.iter_errors(yaml.safe_load(text)))
    if error is None:
        return None
    return str(error.json_path).removeprefix("$.components.traffic.parameters.")


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_it_accepts_the_scenarios_that_ship(path: Path, validator: Draft202012Validator) -> None:
    assert list(validator.iter_errors(Document.read(path).data)) == []


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_it_refuses_a_misspelt_parameter_in_them(
    path: Path, validator: Draft202012Validator
) -> None:
    data = Document.read(path).data
    for name, entry in data.get("components", {}).items():
        if "type" in entry:
            entry.setdefault("parameters", {})["misspelt"] = 1
            at = [error.json_path for error in validator.iter_errors(data)]
            assert f"$.components.{name}.parameters" in at
            del entry["parameters"]["misspelt"]


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("role: ego", "rol: ego", "entities.ego"),
        ("role: ego", "role: eog", "entities.ego.role"),
        ("36 km/h\n", "[36 km/h]\n", "entities.ego.speed"),
        ("speed: 36 km/h", "speed: fast", "entities.ego.speed"),
        ("speed: 36 km/h", "speed: 51", "entities.ego.speed"),
        ("lane: north, ", "", "entities.ego.start"),
        ("lane: north", "lane: {choice: [north]}", "entities.ego.start"),
        ("lane: north", "lane: 5", "entities.ego.start"),
        ("{choice: [car, truck]}", "car", None),
        ("{choice: [car, truck]}", "5", "entities.collider.kind"),
        ("{uniform: [18 km/h, 36 km/h]}", "{uniform: [18 km/h]}", "entities.collider.speed"),
        ("{uniform: [18 km/h, 36 km/h]}", "{normal: {mean: 3}}", "entities.collider.speed"),
        ("uniform: [18 km/h, 36 km/h]", "unifrom: [1, 2]", "entities.collider.speed"),
        ("choice: [car, truck]", "choice: []", "entities.collider.kind"),
        ("gone: null", "gone!: null", "entities"),
        ("gone: null", "choice: null", "entities"),
        ("after: 500 ms", "level: 3 dBm", "stops[0]"),
        ("after: 500 ms", "after: 500", None),
        ("type: encounter", "type: encounters", "$.components.traffic.type"),
        ("type: encounter", "type: broken", None),
    ],
)
def test_it_finds_mistakes_beneath_parameters(
    encounters: Draft202012Validator, old: str, new: str, place: str | None
) -> None:
    assert problem(encounters) is None
    found = problem(encounters, (old, new))
    assert found == place or (found and place and found.startswith(f"{place}."))


@dataclass(frozen=True)
class Node:
    """A record that contains itself."""

    name: str = parameter(doc="of the node")
    inner: tuple["Node", ...] = parameter((), doc="below it")


def test_a_record_may_contain_itself() -> None:
    schemas = ParameterSchemas(is_whole=True)
    root = Parameter(type=Node, default=REQUIRED)
    schema = {**schemas.parameter(root), "$defs": schemas.definitions}
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    assert validator.is_valid({"name": "a", "inner": [{"name": "b", "inner": [{"name": "c"}]}]})
    assert not validator.is_valid({"name": "a", "inner": [{"name": "b", "inner": [{}]}]})
    assert len(schemas.definitions) == 1


def test_it_offers_names_and_takes_paths() -> None:
    known = Parameter(type=str | Path, default=REQUIRED, names=lambda: ("bev-16", "bev-32"))
    schemas = ParameterSchemas(is_whole=True)
    offered = schemas.parameter(known)
    assert offered["anyOf"][0] == {"enum": ["bev-16", "bev-32"]}
    for schema in (offered, schemas.parameter(Parameter(type=str | Path, default=REQUIRED))):
        validator = Draft202012Validator(schema)
        assert validator.is_valid("bev-16")
        assert validator.is_valid("./mine.safetensors")
        assert not validator.is_valid(16)


def test_a_file_that_extends_another_need_not_repeat_what_is_required(
    encounters: Draft202012Validator,
) -> None:
    part = ("schema: 1\n", "schema: 1\nextends: a.yaml\n")
    missing = ("- after: 500 ms", "- level: 3 dBm")
    assert problem(encounters, missing) == "stops[0]"
    assert problem(encounters, part, missing) is None
    assert problem(encounters, part, ("role: ego", "rol: ego")) == "entities.ego"


def test_algorithms_and_measures_are_known(sample_units: None) -> None:
    validator = Draft202012Validator(installed_schema())
    entry: dict[str, Any] = {"type": "receiver", "step": 1, "parameters": {"gain": 1}}
    good: dict[str, Any] = {
        "schema": 1, "title": "T", "time": {"stop": 1}, "components": {"a": entry}
    }  # fmt: skip
    assert validator.is_valid(good)
    assert validator.is_valid(good | {"coupling": {"algorithm": "fixed-point", "relaxation": 0.5}})
    assert not validator.is_valid(good | {"coupling": {"algorithm": "jacobi", "relaxation": 0.5}})
    assert validator.is_valid(good | {"coupling": {"algorithm": "jacobi", "relaxation": None}})
    assert not validator.is_valid(good | {"measures": {"span": {"sginal": "a.y"}}})
    assert not validator.is_valid(good | {"measures": {"x": {"type": "span", "sginal": "a.y"}}})
    del entry["parameters"]
    assert not validator.is_valid(good)


@pytest.mark.slow
@given(ENTITY_MAPPINGS)
def test_it_accepts_whatever_is_written(entities: FrozenMapping[Entity | None]) -> None:
    parameter = Parameter(type=Mapping[str, Entity | None], default=REQUIRED)
    schemas = ParameterSchemas(is_whole=True)
    schema = {**schemas.parameter(parameter), "$defs": schemas.definitions}
    said = json.loads(json.dumps(written(parameter, entities)))
    assert list(Draft202012Validator(schema).iter_errors(said)) == []


def test_the_command_prints_it_or_writes_it(
    sample_units: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schema"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == installed_schema()
    assert main(["schema", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == printed
    path = tmp_path / "s.json"
    assert main(["schema", "--out", str(path)]) == 0
    assert f"# yaml-language-server: $schema={path}" in capsys.readouterr().out
    assert json.loads(path.read_text()) == printed
    power = printed["$defs"]["ComponentEntry"]["allOf"]
    (sender,) = (each for each in power if each["if"]["properties"]["type"]["const"] == "sender")
    described = sender["then"]["properties"]["parameters"]["properties"]["power"]
    assert described["description"] == "transmit power [dBm]"
    assert described["default"] == "26.0 dBm"
