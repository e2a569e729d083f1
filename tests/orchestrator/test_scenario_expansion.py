"""Laws of writing out families, for documents of any shape."""

import json
from time import process_time
from typing import Any

import pytest
from hypothesis import given, strategies as st

from orchestrator.scenario.document import Document
from orchestrator.scenario.expansion import expanded
from tests.orchestrator.files import addresses

JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-9, 9)
    | st.sampled_from(["a", "a.b", "{", "{}", "x{1}"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner),
    max_leaves=9,
)
PART = st.sampled_from(
    ["components", "connections", "measures", "time", "coupling", "recording", "title"]
)
ENTRY = st.dictionaries(
    st.sampled_from(["type", "parameters", "from", "to", "until", "order", "include"]), JSON
)


@given(
    st.dictionaries(PART, JSON | st.lists(ENTRY) | st.dictionaries(st.sampled_from("ab"), ENTRY))
    | JSON
)
def test_a_document_without_families_stays_as_it_is(data: Any) -> None:
    document = Document.parse(json.dumps(data), "f.yaml")
    found = expanded(document)
    assert found.document == document
    assert (found.problems, found.remarks, found.instances) == ((), (), frozenset())


BRACES = st.sampled_from(["m", "m.y", "r.{ego}", "{ego}", "{wheel}", "{other}.y", "{}"])
ANYTHING = st.recursive(
    BRACES | st.none() | st.integers(0, 3),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["each", "ego", "m", "m-a", "from", "to", "until", "type"]), inner
        )
    ),
    max_leaves=12,
)


@given(st.dictionaries(PART | st.just("each"), ANYTHING))
def test_families_of_any_shape_are_problems_and_no_failures(data: Any) -> None:
    data.setdefault("each", {"ego": ["a", "b"], "wheel": ["l"]})
    found = expanded(Document.parse(json.dumps(data), "f.yaml"))
    assert all(problem.where.file == "f.yaml" for problem in found.problems)
    assert len(set(found.problems)) == len(found.problems)
    if found.document.data:
        assert "each" not in found.document.data


MEMBERS = st.lists(st.sampled_from(["a", "b2", "c_3", "4"]), unique=True, min_size=1)


@given(MEMBERS, MEMBERS)
def test_every_value_has_the_place_of_what_it_was_written_out_from(
    ego: list[str], wheel: list[str]
) -> None:
    data = {
        "each": {"ego": ego, "wheel": wheel},
        "components": {"m": {"each": "ego", "parameters": {"x": ["{wheel}", 1, ["{ego}"]]}}},
        "connections": [{"from": "m.y", "to": "m.u"}, {"from": "r.y", "to": "m.u{wheel}"}],
    }
    source = Document.parse(json.dumps(data, indent=1), "f.yaml")
    found = expanded(source).document

    for address in addresses(found.data):
        assert found.places[address] == source.places[found.written(address)]
    assert set(addresses(found.data)) == set(found.places)
    assert list(found.data["components"]) == [f"m-{each}" for each in ego]
    for each in ego:
        assert found.data["components"][f"m-{each}"]["parameters"]["x"] == [*wheel, 1, [each]]
    pairs = [(each["from"], each["to"]) for each in found.data["connections"]]
    assert pairs[: len(ego)] == [(f"m-{each}.y", f"m-{each}.u") for each in ego]
    assert set(pairs[len(ego) :]) == {("r.y", f"m-{e}.u{w}") for e in ego for w in wheel}


@pytest.mark.parametrize(
    "naming",
    [
        {"components": {"m": {"each": "ego"}}},
        {"components": {"m": {"parameters": {"x": "{ego}"}}}},
        {"components": {"m": {"parameters": {"x": ["{ego}"]}}}},
        {"connections": [{"from": "r.{ego}.y", "to": "m.u"}]},
        {"connections": [{"from": "r.y", "to": "m.{ego}"}]},
        {"measures": {"far": {"signal": "m-{ego}.y"}}},
        {"time": {"until": "m-{ego}.y"}},
        {"coupling": {"order": ["m-{ego}"]}},
        {"recording": {"include": ["m-{ego}.*"]}},
        {"title": "no braces"},
        {"title": "{ego}"},
    ],
)
def test_a_family_is_used_wherever_placeholders_stand_for_its_members(naming: Any) -> None:
    """A single member is filled in everywhere; in a title, braces are braces."""
    data = {"each": {"ego": ["a"]}, **naming}
    found = expanded(Document.parse(json.dumps(data), "f.yaml"))
    assert found.problems == ()
    is_used = "title" not in naming
    assert len(found.remarks) == (not is_used)
    assert ("{ego}" in json.dumps(found.document.data)) == (naming == {"title": "{ego}"})


@pytest.mark.parametrize("members", [["a", "b"], ["a", "b", "c"]])
def test_several_members_are_too_many_for_one_text_however_few(members: list[str]) -> None:
    """Two as well as three: where one value is needed, the first is offered, not taken."""
    data = {
        "each": {"ego": members},
        "components": {"m": {"parameters": {"x": "{ego}"}}},
        "connections": [{"from": "r.{ego}.y", "to": "m.u"}],
        "time": {"until": "r.{ego}.y"},
    }
    found = expanded(Document.parse(json.dumps(data), "f.yaml"))
    count = len(members)
    text, output, until = (problem.what for problem in found.problems)
    assert f"`{{ego}}` stands for {count} members ({', '.join(members)})" in text
    assert f"`r.{{ego}}.y` is {count} outputs, and an input takes one" in output
    assert f"`r.{{ego}}.y` is {count} outputs, and one ends the run; write `r.a.y`" in until


@pytest.mark.slow
def test_a_file_of_many_keys_is_written_out_in_a_time_that_grows_with_their_number() -> None:
    """A walk over all places for each key took a minute for 30,000."""
    document = Document.parse("\n".join(f"k{i}: [1]" for i in range(40_000)), "f.yaml")
    began = process_time()
    assert expanded(document).document == document
    assert process_time() - began < 10
