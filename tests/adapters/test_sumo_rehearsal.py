"""`nlosim check` begins a run elsewhere: what only SUMO can tell is found at its place."""

import json
from pathlib import Path

import pytest

import scenarios
from orchestrator.cli import main

SCENARIO = Path(scenarios.__file__).parent / "red_light.yaml"
ENTITIES = "components.traffic.parameters.entities"


def line_of(text: str) -> int:
    """The line of the shipped scenario that begins with `text`."""
    lines = SCENARIO.read_text(encoding="utf-8").splitlines()
    return next(k for k, line in enumerate(lines, 1) if line.strip().startswith(text))


@pytest.mark.parametrize(
    ("change", "key", "what"),
    [
        (f"{ENTITIES}.blocking.count=40", "count", "is 40, but lane `south_in_2` has room for"),
        (f"{ENTITIES}.ego.position.to_end=500 m", "to_end", "is 500 m, but before the end of"),
        (f"{ENTITIES}.ego.position.lane=west_out_0", "", "does not cross that of"),
        (f"{ENTITIES}.sharer.position.lane=south_in_2", "", "there is no room for `blocking.0`"),
    ],
    ids=["queue", "place", "way", "room"],
)
def test_what_ends_a_run_at_its_start_is_found_by_check(
    change: str, key: str, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["check", str(SCENARIO), "--set", change, "--json"])
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert code == 2
    assert any(what in problem["message"] for problem in problems), problems
    (found,) = [problem for problem in problems if what in problem["message"]]
    assert found["message"].startswith(f"{ENTITIES}.")
    if key:
        assert change.partition("=")[0].endswith(key)
        assert found["file"] == f"--set {change}"
    else:
        assert found["file"] == str(SCENARIO)
        assert found["line"] > line_of("entities:")


def test_a_sound_scenario_passes_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["check", str(SCENARIO)]) == 0
    assert list(tmp_path.iterdir()) == []
