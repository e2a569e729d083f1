"""SUMO's drivers see the ego vehicle where it is."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from adapters.sumo.ego import Command
from adapters.sumo.fleet import Poses
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.simulation import Sumo
from adapters.sumo.traffic import Traffic
from orchestrator.randomness import stream

SCENE = Path(__file__).parents[2] / "scenarios" / "assets" / "red_light" / "red_light.sumocfg"
H = 50_000_000
LENGTH = np.array([4.93])


def brake(t: float) -> tuple[float, float, float]:
    return 0.0, 0.4 * (t > 5.0), 0.0


def stop_and_go(t: float) -> tuple[float, float, float]:
    return 0.5 * (math.sin(t) > 0.5), 0.6 * (math.sin(t) < -0.5), 0.0


def weave(t: float) -> tuple[float, float, float]:
    return 0.0, 0.0, 0.03 * math.cos(2.0 * t)


@pytest.mark.parametrize("policy", [brake, stop_and_go, weave])
def test_sumo_has_the_ego_where_it_is_at_every_step(
    policy: Callable[[float], tuple[float, float, float]],
) -> None:
    """Along its lane to 1 cm, with its heading; across, SUMO has everybody in the middle."""
    parameters = TrafficParameters(scene=SCENE, spacing=60.0)
    sumo = Sumo(SCENE, H, 1)
    try:
        traffic = Traffic(sumo, parameters, stream(1, "traffic"), 0)
        for k in range(320):
            traffic.advance(Command.of(np.array(policy(k * 0.05))), 1)
            seen, truth = Poses.from_sumo(sumo.poses(("ego",)), LENGTH), traffic.outputs
            apart = seen.center[0] - np.asarray(truth["ego.position"])
            aside = float(np.asarray(truth["ego.position"])[0]) - 7.0
            turned = 0.5 * LENGTH[0] * math.cos(float(truth["ego.heading"]))
            assert abs(apart[1]) < 0.01
            assert apart[0] == pytest.approx(-aside - turned, abs=0.01)
            assert seen.heading[0] == pytest.approx(float(truth["ego.heading"]), abs=1e-9)
            speed = float(np.hypot(*seen.velocity[0]))
            assert speed == pytest.approx(float(truth["ego.speed"]), abs=0.15)
    finally:
        sumo.close()
