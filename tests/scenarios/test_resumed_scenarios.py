"""Scenarios that ship are gone on with from the middle: the same bytes."""

from pathlib import Path

import pytest

import scenarios
from orchestrator.resume import go_on, unfinished
from orchestrator.run import run_scenario
from orchestrator.run_outcome import RunInterrupted
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.model import Scenario
from tests.orchestrator.resumable import Cut, contents

FOLDER = Path(scenarios.__file__).parent
MS = 1_000_000

SOME = {
    "red_light": ("lidar", "perception", "channel"),
    "red_light_trace": ("lidar", "perception"),
    "several_egos": ("channel", "own-south"),
    "pedestrian": ("lidar", "perception", "channel"),
}
"""Who is restored in them; all others step again, SUMO among them."""


def loaded(name: str) -> Scenario:
    return load_scenario(FOLDER / f"{name}.yaml", ["time.stop=400 ms"])


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_the_rest_of_the_run_is_the_same(name: str, tmp_path: Path) -> None:
    whole = run_scenario(loaded(name), tmp_path / "whole", figure=False)
    with pytest.raises(RunInterrupted):
        run_scenario(
            loaded(name),
            tmp_path / "cut",
            figure=False,
            checkpoint=100 * MS,
            observers=[Cut(310 * MS)],
        )
    found, manifest = unfinished(tmp_path / "cut")
    assert found is not None
    assert found.found is not None
    assert set(SOME[name]) <= set(found.found.content["states"])
    assert found.time == 300 * MS
    resumed = go_on(found, manifest)
    assert resumed.fingerprint == whole.fingerprint
    assert resumed.metrics == whole.metrics
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")
