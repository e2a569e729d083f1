"""A run of declared entities is its scenario and its seed, wherever SUMO runs."""

from pathlib import Path

import numpy as np
import pytest

from adapters.sumo import SumoTraffic
from adapters.sumo.entities import Finish
from adapters.sumo.errors import SumoError
from adapters.sumo.parameters import TrafficParameters
from orchestrator.distribution import Constant
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.testing import check_component
from tests.adapters.sumo_runs import H, car, scene, simulate
from tests.adapters.test_sumo_census import TOWN_DEMAND, TOWN_EXTRA

SCENARIO = """
schema: 1
title: Two egos in a town
time: {{start: 0 s, stop: 12 s}}
seed: 3
components:
  traffic:
    type: sumo-traffic
    step: 100 ms
    process: true
    parameters:
      scene: {scene}
      step_length: 50 ms
      entities:
        first:
          type: car
          position: {{lane: wm_2, s: 60 m}}
          speed: {{uniform: [4, 8]}}
          controller: policy
          finish: {{crossing: cuts, distance: 5 m}}
        second:
          type: bus
          position: {{lane: em_2, s: 40 m}}
          speed: 5 m/s
          controller: policy
          enters: 1 s
        maybe: {{type: car, position: {{lane: nm_1, s: 60 m}}, presence: 0.5, controller: policy}}
        cuts:
          type: car
          position: {{lane: sm_1}}
          speed: {{normal: {{mean: 6, deviation: 1, low: 4, high: 8}}}}
          synchronise: {{entity: first, hold_distance: 10 m}}
        foot:
          type: DEFAULT_PEDTYPE
          position: {{x: -40 m, y: -8 m}}
          trajectory: [{{time: 6 s, x: -40 m, y: 8 m}}]
          trigger: {{entity: first, closer_than: 40 m}}
      background: {{spacing: 30 m}}
      equipment: {{all: {{radio: 0.5, lidar: 0.3, lidar_limit: 3}}}}
"""

SHARES = """
    <vType id="hatchback"><param key="share" value="0.8"/></vType>
    <vType id="truck" vClass="truck"><param key="share" value="0.2"/></vType>
"""


def written(folder: Path) -> Path:
    """The scenario, on the town with its own demand."""
    town = scene(folder, "town", TOWN_DEMAND, extra=TOWN_EXTRA + SHARES)
    path = folder / "two.yaml"
    path.write_text(SCENARIO.format(scene=town))
    return path


@pytest.mark.slow
def test_two_runs_are_equal_over_the_loopback_too_and_another_seed_is_not(tmp_path: Path) -> None:
    path = written(tmp_path)

    def fingerprint(name: str, *overrides: str, transport: str = "in-process") -> str:
        run = run_scenario(load_scenario(path, overrides), tmp_path / name, transport=transport)
        return str(run.fingerprint)

    one = fingerprint("one")
    assert fingerprint("again") == one
    assert fingerprint("remote", transport="loopback") == one
    assert fingerprint("other", "seed=4") != one


def test_several_egos_keep_the_contract_of_components(tmp_path: Path) -> None:
    """One of them enters later, one never."""
    entities = {
        "a": car("east_1_0", 60.0, speed=Constant(8.0), controller="policy", finish=Finish()),
        "b": car("west_1_0", 60.0, speed=Constant(8.0), controller="policy", enters=1.0),
        "c": car("north_1_0", 60.0, speed=Constant(8.0), controller="policy", presence=0.0),
    }
    check_component(
        SumoTraffic(TrafficParameters(scene=scene(tmp_path), step_length=0.1, entities=entities)),
        steps=30,
        h=H,
        inputs=lambda _: {f"{name}.command": np.array([0.2, 0.0, 0.1]) for name in entities},
    )


@pytest.mark.slow
def test_a_program_of_its_own_gives_the_same_run(tmp_path: Path) -> None:
    pytest.importorskip("sumo", reason="the package eclipse-sumo, with SUMO's programs")
    path = written(tmp_path)
    runs = [
        run_scenario(load_scenario(path, overrides), tmp_path / str(k))
        for k, overrides in enumerate(([], ["components.traffic.parameters.program=sumo"]))
    ]
    assert runs[0].fingerprint == runs[1].fingerprint


def test_a_scene_that_sumo_refuses_leaves_no_trace(tmp_path: Path) -> None:
    """The next one in the same process is opened."""
    demand = '<vehicle id="nowhere" depart="0"/>'
    with pytest.raises(SumoError, match="SUMO cannot load"):
        simulate(scene(tmp_path, demand=demand), 0.0)
    assert simulate(scene(tmp_path), 0.0, {"a": car("east_1_0", 50.0)}).present(0) == ["a"]
