"""Keeping to the brake: a running maximum, held against its definition."""

from itertools import accumulate
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.driving.policy import Inputs, Network
from fmus.driving.policy.brake_hold import BrakeHold
from fmus.driving.policy.command import Command, Hazard
from fmus.driving.policy.network import NetworkDriver
from tests.fmus.driving.network.world import network

STEP = 50_000_000
PEDAL = st.sampled_from([0.0, 0.1, 0.3, 0.3000001, 1.0])


@given(st.lists(st.tuples(PEDAL, PEDAL, st.integers(0, 4)), max_size=40), st.integers(0, 12))
def test_it_is_the_greatest_brake_of_the_last_moments(
    driven: list[tuple[float, float, int]], duration: int
) -> None:
    """By the definition, at steps of any length, none among them."""
    times = [t * STEP for t in accumulate(wait for *_, wait in driven)]
    given = [Command(accelerate=a, brake=b, steer=b - a) for a, b, _ in driven]
    hold = BrakeHold(duration * STEP)
    for k, (command, now) in enumerate(zip(given, times, strict=True)):
        held = hold.held(command, now)
        last = range(k + 1)
        kept = [given[j].brake for j in last if duration and now - times[j] <= duration * STEP]
        brake = max([command.brake, *kept])
        assert held.brake == brake
        assert held.steer == command.steer
        assert held.accelerate == (command.accelerate if brake == command.brake else 0.0)


def test_what_the_brake_is_used_for_stays() -> None:
    hold, hazard = BrakeHold(STEP), Hazard(instance=3, sensor=1, age=0.2)
    hold.held(Command(brake=0.6), 0)
    assert hold.held(Command(brake=0.2, hazard=hazard), STEP).hazard == hazard


def test_the_newest_of_equal_brakes_counts() -> None:
    """It was pressed until then; so long after that it is released, not before."""
    hold = BrakeHold(2 * STEP)
    brakes = [0.4, 0.4, 0.4, 0.0, 0.0, 0.0]
    held = [hold.held(Command(brake=b), k * STEP).brake for k, b in enumerate(brakes)]
    assert held == [0.4, 0.4, 0.4, 0.4, 0.4, 0.0]


def driven(folder: Path, monkeypatch: pytest.MonkeyPatch, **parameters: float) -> list[list[float]]:
    """Commands of a policy whose network brakes once, at its second step, in two runs."""
    path = folder / "a.safetensors"
    network().write(path)
    wanted = [[0.5, 0.0, 0.1], [0.0, 0.7, 0.2], [0.5, 0.0, 0.3], [0.5, 0.0, 0.4]]
    monkeypatch.setattr(
        NetworkDriver, "command", lambda _self, _inputs, now: np.array(wanted[now // STEP])
    )
    policy = Network(Network.Parameters(network=str(path), **parameters))
    found = []
    for _ in range(2):  # the second is no other: a run begins with the brake released
        policy.begin(0, np.random.default_rng(0))
        commands = [policy.drive(Inputs.read({}, frozenset()), k * STEP) for k in range(4)]
        found.append([[c.accelerate, c.brake, c.steer] for c in commands])
    assert found[0] == found[1]
    return found[1]


def test_a_network_keeps_to_its_brake_for_as_long_as_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for_one_step = driven(tmp_path, monkeypatch, brake_hold=0.05)
    assert for_one_step == [[0.5, 0.0, 0.1], [0.0, 0.7, 0.2], [0.0, 0.7, 0.3], [0.5, 0.0, 0.4]]


def test_by_default_a_network_keeps_to_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = driven(tmp_path, monkeypatch)
    assert plain == [[0.5, 0.0, 0.1], [0.0, 0.7, 0.2], [0.5, 0.0, 0.3], [0.5, 0.0, 0.4]]
