"""The JSON Schema and the reference are current, and agree with what is accepted."""

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]

from orchestrator.scenario import reference
from orchestrator.scenario.document import Document

ROOT = Path(__file__).parents[2]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = json.loads((ROOT / reference.SCHEMA_FILE).read_text())
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def test_the_published_schema_is_current() -> None:
    committed = (ROOT / reference.SCHEMA_FILE).read_text()
    assert committed == reference.schema_text(), "run python -m orchestrator.scenario.reference"


def test_the_reference_is_current() -> None:
    committed = (ROOT / reference.REFERENCE_FILE).read_text()
    assert committed == reference.reference_text(), "run python -m orchestrator.scenario.reference"


def test_every_key_has_a_description() -> None:
    schema = json.loads(reference.schema_text())
    for name, model in {"the file": schema, **schema["$defs"]}.items():
        assert model["description"], name
        for key, value in model["properties"].items():
            assert "description" in value or "$ref" in value, f"{name}.{key}"


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_the_schema_accepts_the_scenarios_that_ship(
    path: Path, validator: Draft202012Validator
) -> None:
    assert list(validator.iter_errors(Document.read(path).data)) == []


@pytest.mark.parametrize(
    "change",
    [
        {"schema": 2},
        {"titel": "x"},
        {"time": {"start": 0}},
        {"time": {"stop": "soon"}},
        {"seed": -1},
        {"coupling": {"algorithm": 1}},
        {"components": {}},
        {"components": {"a": {"type": "t", "fmu": "f", "step": 1}}},
        {"components": {"a": {"step": 1}}},
        {"components": {"a": {"type": "t"}}},
        {"connections": [{"from": "a", "to": "b.c"}]},
        {"each": {"ego": []}},
        {"each": {"ego": "first"}},
        {"each": {"ego": ["first", "first"]}},
        {"each": {"ego": ["the first"]}},
        {"components": {"a": {"type": "t", "step": 0.1, "each": ["ego"]}}},
    ],
)
def test_the_schema_refuses_what_is_refused(
    validator: Draft202012Validator, change: dict[str, Any]
) -> None:
    good = {
        "schema": 1,
        "title": "T",
        "time": {"stop": "1 s"},
        "components": {"a": {"type": "t", "step": 0.1}},
    }
    assert validator.is_valid(good)
    assert not validator.is_valid(good | change)
    assert validator.is_valid(good | {"each": {"ego": ["first", "2"]}})
