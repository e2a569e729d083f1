"""The order of declarations numbers entities and draws for them; it places and moves nobody."""

import itertools
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.sumo.entities import Synchronise
from adapters.sumo.errors import SumoError
from orchestrator.distribution import Constant, Uniform
from tests.adapters.red_light import SCENE, STEP, red_light
from tests.adapters.sumo_runs import Run, car, on, scene, simulate

CHAIN = {
    "a": car("east_1_0", 100.0, speed=Constant(8.0)),
    "b": car("north_1_0", speed=Constant(9.0), synchronise=Synchronise(entity="a")),
    "c": car("west_1_0", speed=Constant(10.0), synchronise=Synchronise(entity="b")),
}


def red_light_in(order: Iterable[str]) -> Run:
    """The shipped red light with its entities declared in this order; the ego coasts."""
    shipped = red_light()
    entities = {name: shipped.entities[name] for name in order}
    background = shipped.background
    return simulate(SCENE, 16.0, entities, seed=3, h=STEP, background=background)


def assert_same_motion(one: Run, other: Run) -> None:
    """Everybody is where they are in the other run, bit by bit."""
    assert one.number.keys() == other.number.keys()
    for name in one.number:
        for signal in ("position", "heading", "velocity"):
            np.testing.assert_array_equal(one.of(name, signal), other.of(name, signal), name)


def test_the_red_light_is_the_same_in_the_reverse_order() -> None:
    """Whom the collision vehicle is to meet is declared after it, and all others behave alike."""
    names = list(red_light().entities)
    assert names.index("ego") < names.index("collider")
    assert_same_motion(red_light_in(names), red_light_in(reversed(names)))


def test_whoever_follows_somebody_who_follows_somebody_is_placed_after_both(tmp_path: Path) -> None:
    """In every order; numbers and roles are those of the declarations."""
    shipped = simulate(scene(tmp_path), 8.0, CHAIN)
    speed = np.linalg.norm(shipped.of("c", "velocity"), axis=1)
    assert np.ptp(speed[1:]) > 0.1, "it adapts its speed"
    for order in itertools.permutations(CHAIN):
        run = simulate(scene(tmp_path), 8.0, {name: CHAIN[name] for name in order})
        assert run.present(0) == list(order)
        roles = {name: run.array(0, "vehicle.role")[run.row(0, name)] for name in order}
        assert roles == {name: role for role, name in enumerate(order, start=1)}
        assert_same_motion(shipped, run)


def test_speeds_are_drawn_in_the_order_of_the_declarations(tmp_path: Path) -> None:
    """Who is placed after another one has not drawn after it."""
    drawn = {name: replace(CHAIN[name], speed=Uniform(5.0, 9.0)) for name in ("b", "a")}
    free = {**drawn, "b": replace(drawn["b"], position=on("north_1_0", 50.0), synchronise=None)}
    speeds = [
        [np.linalg.norm(run.of(name, "velocity")[0]) for name in drawn]
        for run in (simulate(scene(tmp_path), 0.0, entities) for entities in (drawn, free))
    ]
    assert speeds[0] == speeds[1]
    assert speeds[0][0] != speeds[0][1]


def test_what_is_wrong_with_one_is_not_said_again_of_those_who_follow_it(tmp_path: Path) -> None:
    entities = {**CHAIN, "a": car("nowhere_0", 100.0, speed=Constant(8.0))}
    with pytest.raises(SumoError, match=r"^`entities\.a`: [^\n]*$"):
        simulate(scene(tmp_path), 0.0, entities)
