"""SUMO's drivers see the ego vehicle where it is."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from adapters.sumo.ego import Command
from adapters.sumo.population import Poses
from adapters.sumo.simulation import Sumo
from adapters.sumo.traffic import Traffic
from orchestrator.randomness import stream
from tests.adapters.red_light import SCENE, red_light

LENGTH = np.array([4.93])


def brake(t: float) -> tuple[float, float, float]:
    return 0.0, 0.4 * (t > 5.0), 0.0


def stop_and_go(t: float) -> tuple[float, float, float]:
    return 0.5 * (math.sin(t) > 0.5), 0.6 * (math.sin(t) < -0.5), 0.0


def weave(t: float) -> tuple[float, float, float]:
    return 0.0, 0.0, 0.03 * math.cos(2.0 * t)


@pytest.mark.parametrize("policy", [brake, stop_and_go, weave])
def test_sumo_has_the_ego_where_it_is_at_every_step(
    policy: Callable[[float], tuple[float, float, float]], loaded: Callable[..., Sumo]
) -> None:
    """Along its lane to 1 cm, with its heading; across, SUMO has everybody in the middle."""
    sumo = loaded(SCENE, 1)
    traffic = Traffic(sumo, red_light(background={"spacing": 60.0}), stream(1, "traffic"), 0)
    for k in range(320):
        traffic.advance({"ego": Command.of(np.array(policy(k * 0.05)))}, 1)
        seen = Poses.from_sumo(sumo.vehicle_poses(("ego",)), LENGTH)
        truth = traffic.outputs
        apart = seen.center[0] - np.asarray(truth["ego.position"])
        aside = float(np.asarray(truth["ego.position"])[0]) - 7.0
        turned = 0.5 * LENGTH[0] * math.cos(float(np.asarray(truth["ego.heading"])))
        assert abs(apart[1]) < 0.01
        assert apart[0] == pytest.approx(-aside - turned, abs=0.01)
        assert seen.heading[0] == pytest.approx(float(np.asarray(truth["ego.heading"])), abs=1e-9)
        speed = float(np.hypot(*seen.velocity[0]))
        assert speed == pytest.approx(float(np.asarray(truth["ego.speed"])), abs=0.15)
