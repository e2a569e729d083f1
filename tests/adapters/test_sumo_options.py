"""The options that SUMO is started with: what the parameters say, and what they call for."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.sumo.entities import Entity, Position, SpeedPoint, Synchronise
from adapters.sumo.options import is_anybody_moved_here, sumo_options
from adapters.sumo.parameters import TrafficParameters
from orchestrator.parameters import declared

SCENE = Path("a") / "scene.sumocfg"
ON = Position(lane="east_1_0", s=50.0)
ALWAYS = {
    "--configuration-file": str(SCENE),
    "--step-length": "0.050",
    "--seed": "7",
    "--no-step-log": "true",
    "--no-warnings": "true",
    "--duration-log.disable": "true",
    "--random": "false",
}


def car(**more: Any) -> Entity:
    return Entity(type="car", position=ON, **more)


def options(seed: int = 7, **given: Any) -> dict[str, str]:
    """What differs from the options that are always there."""
    found = sumo_options(TrafficParameters(scene=SCENE, step_length=0.05, **given), seed)
    assert found.keys() >= ALWAYS.keys()
    return {name: value for name, value in found.items() if ALWAYS.get(name) != value}


def test_a_scene_of_its_own_is_left_as_it_is() -> None:
    assert options() == {}
    assert options(entities={"a": None}).keys() <= {"--collision.action"}


def test_the_seed_is_that_of_the_run_unless_the_parameters_have_one() -> None:
    assert options(seed=8) == {"--seed": "8"}
    assert options(seed=8, sumo_seed=7) == {}
    assert options(sumo_seed=0) == {"--seed": "0"}


@pytest.mark.parametrize("scale", [0.0, 0.1, 1 / 3, 2.0])
def test_the_scale_arrives_to_the_bit(scale: float) -> None:
    (text,) = options(scale=scale).values()
    assert float(text) == scale


def test_sumo_does_nothing_about_bodies_that_overlap_where_there_are_entities() -> None:
    assert options(entities={"a": car()}) == {"--collision.action": "none"}


@pytest.mark.parametrize(
    ("more", "is_moved"),
    [
        ({}, False),
        ({"parked": True}, False),
        ({"controller": "policy"}, True),
        ({"speed_profile": (SpeedPoint(time=0.0, speed=0.0),)}, True),
        ({"synchronise": Synchronise(entity="b")}, True),
    ],
    ids=["waits", "parked", "driven", "profile", "synchronised"],
)
def test_sumo_lifts_nobody_off_the_road_whom_it_does_not_move(
    more: dict[str, Any], *, is_moved: bool
) -> None:
    """One of them is enough, wherever it is declared."""
    entities = {"none": None, "b": car(), "a": car(**more)}
    given = TrafficParameters(scene=SCENE, entities=entities)
    assert is_anybody_moved_here(given) == is_moved
    assert options(entities=entities).get("--time-to-teleport") == ("-1" if is_moved else None)


def test_the_seed_is_any_number_that_sumo_can_read() -> None:
    """`--seed` is a signed integer of 32 bits; negative ones mean nothing to SUMO."""
    seed = declared(TrafficParameters)["sumo_seed"]
    assert (seed.minimum, seed.maximum) == (0, np.iinfo(np.int32).max)
