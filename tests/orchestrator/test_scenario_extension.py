"""`extends:`: what a file says over what its base says, and every problem in the right file."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Document
from orchestrator.scenario.extension import overlaid
from orchestrator.scenario.schema import json_schema
from tests.orchestrator.files import addresses

HEAD = "schema: 1\nextends: two.yaml\n"
Write = Callable[[str], Path]

JSON = st.recursive(
    st.none() | st.integers(-9, 9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner),
    max_leaves=9,
)
MAPPING = st.dictionaries(st.sampled_from("abc"), JSON)


@pytest.fixture
def write(scenario_file: Path) -> Write:
    """Write `over.yaml`, which extends `two.yaml` beside it."""

    def write(text: str) -> Path:
        path = scenario_file.with_name("over.yaml")
        path.write_text(HEAD + text)
        return path

    return write


def problems(path: Path, *overrides: str) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        load_scenario(path, overrides)
    return [str(problem).removeprefix(f"{path.parent}/") for problem in error.value.problems]


def merged(base: str, overlay: str) -> Any:
    return overlaid(Document.parse(base, "base"), Document.parse(overlay, "over")).data


def test_a_file_says_only_what_differs(write: Write, scenario_file: Path) -> None:
    base = load_scenario(scenario_file)
    over = load_scenario(write("components: {car: {parameters: {count: 4, label: x}}}"))
    expected = base.resolved()
    expected["components"]["car"]["parameters"] |= {"count": 4, "label": "x"}
    assert over.resolved() == expected
    assert over.name == "over"


@pytest.mark.parametrize(
    ("base", "overlay", "data"),
    [
        ("a: 1\nb: {c: 2}", "b: {d: 3}", {"a": 1, "b": {"c": 2, "d": 3}}),
        ("a: {b: {c: 1}}", "a: {b: 2}", {"a": {"b": 2}}),
        ("a: 1", "a: {b: 2}", {"a": {"b": 2}}),
        ("a: [1, 2, 3]", "a: [4]", {"a": [4]}),
        ("a: {b: 1}", "a: ~", {"a": None}),
        ("schema: 1\nextends: x", "a: 1", {"a": 1}),
        ("a: 1", "schema: 1\nextends: base", {"a": 1, "schema": 1}),
    ],
)
def test_mappings_are_merged_and_anything_else_replaces(base: str, overlay: str, data: Any) -> None:
    assert merged(base, overlay) == data


@pytest.mark.parametrize(
    ("overlay", "car"),
    [
        ("{step: 2}", {"type": "t", "step": 2, "process": True, "parameters": {"p": 1}}),
        ("{type: t}", {"type": "t", "step": 1, "process": True, "parameters": {"p": 1}}),
        ("{type: u}", {"type": "u", "step": 1, "process": True}),
        ("{fmu: t}", {"fmu": "t", "step": 1, "process": True}),
        (
            "{type: u, parameters: {q: 2}}",
            {"type": "u", "step": 1, "process": True, "parameters": {"q": 2}},
        ),
    ],
)
def test_another_type_starts_without_parameters(overlay: str, car: Any) -> None:
    base = "components: {car: {type: t, step: 1, process: true, parameters: {p: 1}}}"
    assert merged(base, f"components: {{car: {overlay}}}") == {"components": {"car": car}}


def test_the_same_fmu_by_another_path_keeps_its_parameters(tmp_path: Path) -> None:
    """Paths are compared from the folders of the files that say them."""
    inner = tmp_path / "inner"
    inner.mkdir()
    documents = []
    for path, fmu in (
        (tmp_path / "base.yaml", "inner/x.fmu"),
        (inner / "same.yaml", "x.fmu"),
        (inner / "other.yaml", "inner/x.fmu"),
    ):
        path.write_text(f"components: {{car: {{fmu: {fmu}, parameters: {{p: 1}}}}}}")
        documents.append(Document.read(path))
    base, same, other = documents
    bare = {"components": {"car": {"fmu": "x.fmu"}}}
    for overlay, parameters in ((same, {"p": 1}), (other, None)):
        overlay.data["components"]["car"].pop("parameters")
        found = overlaid(base, overlay).data["components"]["car"]
        assert found.get("parameters") == parameters
    assert same.data == bare


@given(MAPPING, MAPPING)
def test_values_of_the_overlay_win_and_every_value_has_its_place(
    base: dict[str, Any], over: dict[str, Any]
) -> None:
    documents = [Document.parse(json.dumps(d), name) for d, name in ((base, "b"), (over, "o"))]
    found = overlaid(*documents)

    for address in addresses(found.data):
        is_over = address in documents[1].places
        assert found.places[address].value.file == ("o" if is_over else "b")
    assert set(addresses(found.data)) == set(found.places)
    assert overlaid(documents[0], found).data == found.data
    assert overlaid(documents[0], documents[0]).data == base
    for key, value in over.items():
        if not isinstance(value, dict):
            assert found.data[key] == value
    assert {k: v for k, v in found.data.items() if k not in over} == {
        k: v for k, v in base.items() if k not in over
    }


def test_connections_replace_all_connections(write: Write) -> None:
    scenario = load_scenario(write("connections: [{from: car.vehicle.x, to: base.u}]"))
    assert [(c.source, c.target) for c in scenario.connections] == [("car.vehicle.x", "base.u")]


def test_bases_may_extend_others(write: Write, scenario_file: Path) -> None:
    write("seed: 8\ntitle: Over\n")
    top = scenario_file.with_name("top.yaml")
    top.write_text("schema: 1\nextends: over.yaml\nseed: 9\n")
    scenario = load_scenario(top)
    assert (scenario.seed, scenario.title, len(scenario.components)) == (9, "Over", 2)


def test_a_base_need_not_be_complete(scenario_file: Path) -> None:
    text = scenario_file.read_text()
    scenario_file.write_text(text.replace("time: {start: 0 s, stop: 1 s}\n", ""))
    over = scenario_file.with_name("over.yaml")
    over.write_text(HEAD + "time: {stop: 2 s}\n")
    assert load_scenario(over).stop == 2 * 10**9


def test_paths_start_at_the_file_that_says_them(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = scenario_file.parent / "variants"
    folder.mkdir()
    for parent in (scenario_file.parent, folder):
        (parent / "trace.csv").write_text("")
    scenario_file.write_text(scenario_file.read_text().replace("noisy: true", "trace: trace.csv"))
    over = folder / "over.yaml"
    over.write_text("schema: 1\nextends: ../two.yaml\n")
    monkeypatch.chdir(folder.parent)

    def trace(*overrides: str) -> Path:
        found = load_scenario(Path("variants/over.yaml"), overrides).components["car"]
        return Path(found.values["trace"]).resolve()

    assert trace() == scenario_file.parent / "trace.csv"
    assert trace("components.car.parameters.trace=trace.csv") == folder / "trace.csv"
    with over.open("a") as file:
        file.write("components: {car: {parameters: {trace: trace.csv}}}\n")
    assert trace() == folder / "trace.csv"


def mistakes() -> Iterator[tuple[str, str]]:
    """Text and message of each entry of `extension_problems.txt`."""
    text = Path(__file__).with_name("extension_problems.txt").read_text()
    for block in text.strip().split("\n\n")[1:]:
        over, problem = block.split("\n")
        yield over.removeprefix("+ "), problem


@pytest.mark.parametrize(("text", "problem"), list(mistakes()))
def test_problems_are_in_the_file_that_causes_them(write: Write, text: str, problem: str) -> None:
    found = problems(write(text))
    assert any(each.startswith(problem) for each in found), found


def test_a_connection_of_the_base_that_does_not_fit_any_more_is_reported_there(
    write: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write("components: {base: {type: sender}}")
    assert main(["check", str(path)]) == 2
    assert f"{path.with_name('two.yaml')}:19:5: connections[0]: " in capsys.readouterr().out


def test_a_wrong_value_of_the_base_is_reported_there(write: Write, scenario_file: Path) -> None:
    scenario_file.write_text(scenario_file.read_text().replace("count: 2", "count: two"))
    (problem,) = problems(write("seed: 8"))
    assert problem.startswith('two.yaml:11:40: components.car.parameters.count: "two"')
    assert load_scenario(write("components: {car: {parameters: {count: 2}}}")).seed == 7


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (
            {"a.yaml": "schema: 1\nextends: b.yaml"},
            "a.yaml:2:10: extends: there is no file {folder}/b.yaml (the path is relative to",
        ),
        (
            {"a.yaml": "schema: 1\nextends: a.yaml"},
            "a.yaml:2:10: extends: this is a circle: `a.yaml` -> `a.yaml`",
        ),
        (
            {
                "a.yaml": "schema: 1\nextends: b.yaml",
                "b.yaml": "schema: 1\n\nextends: ./c.yaml",
                "c.yaml": "schema: 1\nextends: b.yaml",
            },
            "c.yaml:2:10: extends: this is a circle: `a.yaml` -> `b.yaml` -> `c.yaml` -> `b.yaml`",
        ),
        (
            {"a.yaml": "extends: [b.yaml, c.yaml]"},
            "a.yaml:1:10: extends: expected the path of a scenario file, got a list",
        ),
        (
            {"a.yaml": "extends:"},
            "a.yaml:1:9: extends: expected the path of a scenario file, got nothing",
        ),
        (
            {"a.yaml": "extends: ."},
            "a.yaml:1:10: extends: there is no file {folder} (the path",
        ),
        pytest.param(
            {"a.yaml": "extends: /dev/zero"},
            "a.yaml:1:10: extends: /dev/zero is a device, not a file",
            marks=pytest.mark.skipif(os.name != "posix", reason="no devices among files"),
        ),
        (
            {"a.yaml": "schema: 1\nextends: b.yaml", "b.yaml": "- 1"},
            "b.yaml:1:1: expected a mapping of `key: value` lines, got a list",
        ),
        (
            {"a.yaml": "schema: 1\nextends: b.yaml", "b.yaml": "title: x\nschema: 2"},
            "b.yaml:2:9: schema: expected `1`, got 2",
        ),
        (
            {"a.yaml": "schema: 1\nextends: b.yaml", "b.yaml": "schema: 1\na: [1"},
            "b.yaml:2:6: the list opened with `[` in line 2 is not closed",
        ),
        (
            {"a.yaml": "extends: b.yaml", "b.yaml": "schema: 1"},
            "a.yaml:1:1: the scenario: `schema` is missing",
        ),
    ],
)
def test_bases_that_cannot_be_extended(
    tmp_path: Path, files: dict[str, str], expected: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    found = problems(tmp_path / "a.yaml")
    wanted = expected.format(folder=tmp_path)
    assert any(problem.startswith(wanted) for problem in found), found


def test_overrides_apply_to_the_whole(write: Write) -> None:
    path = write("components: {car: {parameters: {count: 4}}}")
    scenario = load_scenario(
        path, ["components.car.parameters.count=5", "components.base.parameters.gain=3", "seed=9"]
    )
    assert (scenario.components["car"].values["count"], scenario.seed) == (5, 9)
    assert scenario.components["base"].values["gain"] == 3.0
    swapped = load_scenario(
        path, ["components.car.type=receiver", "components.car.parameters.gain=1"]
    )
    assert [str(r).rsplit("/", 1)[1].split(": ")[0] for r in swapped.remarks] == [
        "two.yaml:11:18",
        "over.yaml:3:33",
        "two.yaml:11:43",
    ]


def test_the_base_cannot_be_set(scenario_file: Path) -> None:
    (problem,) = problems(scenario_file, "extends=other.yaml")
    assert problem.startswith("--set extends=other.yaml:1:1: extends: cannot be set; write a file")


def test_the_manifest_repeats_the_run_without_the_files(
    write: Write, scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    over = write("components: {car: {step: 100 ms, parameters: {power: 20 dBm}}}")

    def run(path: Path, name: str) -> str:
        out = tmp_path / name
        assert main(["run", str(path), "--out", str(out), "--json", "--quiet"]) == 0
        found: str = json.loads(capsys.readouterr().out)["fingerprint"]
        return found

    first = run(over, "first")
    assert run(scenario_file, "base") != first
    manifest = json.loads((tmp_path / "first" / "manifest.json").read_text())
    assert manifest["scenario_file"] == str(over)
    again = tmp_path / "elsewhere" / "again.yaml"
    again.parent.mkdir()
    again.write_text(json.dumps(manifest["scenario"]))
    over.unlink()
    scenario_file.unlink()
    assert run(again, "second") == first


def test_check_and_graph_take_such_files(write: Write, capsys: pytest.CaptureFixture[str]) -> None:
    path = write("components: {car: {step: 10 ms}}")
    assert main(["check", str(path)]) == 0
    verdict, effect = capsys.readouterr().out.strip().split("\n")
    assert verdict == f"{path}: ok, 2 components, 2 connections"
    assert "`base`: `process: on-request` takes effect with" in effect
    assert main(["graph", str(path)]) == 0
    assert "10 ms" in capsys.readouterr().out


@pytest.mark.parametrize(
    "rest",
    [
        {},
        {"time": {"start": 1}},
        {"components": {"a": {"parameters": {"b": 1}}}},
        {"components": {"a": {"type": "t"}}},
    ],
)
def test_the_schema_asks_files_that_extend_others_for_less(rest: dict[str, Any]) -> None:
    validator = Draft202012Validator(json_schema())
    assert validator.is_valid({"schema": 1, "extends": "a.yaml"} | rest)
    assert not validator.is_valid({"schema": 1} | rest)
    assert not validator.is_valid({"extends": "a.yaml"} | rest)


@pytest.mark.parametrize(
    "rest",
    [
        {"components": {"a": {"type": "t", "fmu": "f"}}},
        {"components": {"a": {"stp": 1}}},
        {"connections": [{"from": "a.b"}]},
        {"extends": None},
        {"extends": ["a.yaml"]},
    ],
)
def test_the_schema_still_refuses_mistakes(rest: dict[str, Any]) -> None:
    data = {"schema": 1, "extends": "a.yaml"} | rest
    assert not Draft202012Validator(json_schema()).is_valid(data)
