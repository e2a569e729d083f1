"""Entities and components may be called otherwise than in the shipped scenario."""

from pathlib import Path
from typing import Any

import pytest

from orchestrator.errors import ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.measures import questions_of
from studies.red_light import RedLightReport
from studies.red_light.metrics import compute
from studies.red_light.roles import Names
from studies.red_light.traces import Traces
from tests.studies.red_light.test_metrics import Run, manifest, recording

SCENARIOS = Path(__file__).parents[3] / "scenarios"
OTHER = Names(
    ego="hero",
    collider="runner",
    sharer="witness",
    blocking="trucks",
    traffic="world",
    perception="eyes",
    channel="air",
    facilities="stack",
    relay="relay-hero",
    policy="policy-hero",
    received="stack.hero.received",
)


def test_a_recording_with_other_names_has_the_same_metrics() -> None:
    usual = recording()
    renamed = Run({OTHER.signal(name): samples for name, samples in usual.items()})
    entities = manifest(["hero", "runner", "witness", "trucks"])["scenario"]["components"]
    renamed.manifest = {"scenario": {"components": {"world": entities["traffic"]}}}
    assert {"world.hero.speed", "stack.hero.received.objects", "air.receptions"} <= set(renamed)
    assert not set(renamed) & set(usual)
    assert compute(Traces(renamed, OTHER)) == compute(Traces(usual))


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("{ego: egoo}", "134:45: report.parameters.ego: `traffic` has no entity `egoo`; did you"),
        ("{sharer: nobody}", "134:48: report.parameters.sharer: `traffic` has no entity `nobody`"),
        ("{channel: air}", "134:49: report.parameters.channel: there is no component `air`; there"),
        ("{received: a.b}", "134:50: report.parameters.received: `a.b` is of no component"),
        ("{role: ego}", "134:40: report.parameters.role: there is no parameter `role`; there are"),
    ],
)
def test_names_that_are_not_there_are_located(
    parameters: str, message: str, tmp_path: Path
) -> None:
    text = (SCENARIOS / "left_turn.yaml").read_text().replace("assets/", f"{SCENARIOS}/assets/")
    file = tmp_path / "other.yaml"
    said = f"report: {{type: red-light, parameters: {parameters}}}"
    file.write_text(text.replace("report: red-light", said))
    with pytest.raises(ScenarioError) as error:
        load_scenario(file)
    assert any(f"yaml:{message}" in str(problem) for problem in error.value.problems), str(
        error.value
    )


def test_a_report_does_not_judge_a_component_with_a_wrong_parameter() -> None:
    """Whose entities are not known then: it would miss the ego, which is there."""
    lanes = "components.traffic.parameters.entities.colider={position: {lane: east_in_0}}"
    with pytest.raises(ScenarioError) as error:
        load_scenario(SCENARIOS / "left_turn.yaml", [lanes])
    (problem,) = map(str, error.value.problems)
    assert "entities.colider: the parameter `type` is missing" in problem


def test_a_component_that_every_report_needs_is_missed_before_the_run(tmp_path: Path) -> None:
    text = (SCENARIOS / "city.yaml").read_text().replace("assets/", f"{SCENARIOS}/assets/")
    file = tmp_path / "city.yaml"
    file.write_text(f"{text}report: red-light\n")
    with pytest.raises(ScenarioError, match="there is no component `perception`"):
        load_scenario(file)


def test_the_manifest_keeps_the_names() -> None:
    said: dict[str, Any] = {"type": "red-light", "parameters": {"collider": "sharer"}}
    scenario = load_scenario(SCENARIOS / "left_turn.yaml", [f"report={said}"])
    resolved = scenario.resolved()
    assert resolved["report"] == said
    assert questions_of(resolved).report == RedLightReport(collider="sharer")
    usual = load_scenario(SCENARIOS / "left_turn.yaml").resolved()
    assert usual["report"] == "red-light"
    assert questions_of(usual).report == RedLightReport()
