"""Nakagami fading: its distribution, and what its draws depend on."""

import math

import numpy as np
import pytest

from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene, Vehicle

from .harness import MS, NO_OBSTACLES, Channel, packet, row_of_cars, run

NAKAGAMI = {"fading": 2.0, "medium_access": False, **NO_OBSTACLES}
FRAMES = 200
# E[min(x, 1)] for a power x of Gamma distribution with mean 1 and these shapes
CLIPPED_MEAN = {m: 1 - m ** (m - 1) * math.exp(-m) / math.gamma(m) for m in (0.75, 1.5, 5.0)}


def _factors(library: Library, scene: Scene, frames: int = FRAMES, **parameters: float) -> Array:
    """The factors on the mean power, of shape (frames, receivers)."""
    records = [packet(k, 0, time=k * MS) for k in range(frames)]
    powers = []
    for changed in ({**NAKAGAMI, **parameters}, {**NAKAGAMI, "fading": 1.0}):
        with Channel(library, scene, **changed) as channel:
            received = channel.step(0.0, frames * 1e-3, records)
        order = np.lexsort((received["receiver"], received["packet"]))
        powers.append(received["power_dbm"][order].reshape(frames, -1))
    factors: Array = 10 ** ((powers[0] - powers[1]) / 10)
    return factors


@pytest.mark.parametrize("m", [0.5, 0.75, 1.0, 1.5, 5.0])
def test_the_mean_is_1_and_the_variance_1_over_m(library: Library, m: float) -> None:
    scene = row_of_cars([100.0 + k for k in range(100)])
    factors = _factors(library, scene, fading_far_m=m)
    n = factors.size
    assert factors.mean() == pytest.approx(1, abs=4 * np.sqrt(1 / m / n))
    # of the sample variance: fourth central moment of the Gamma distribution, 3 / m^2 + 6 / m^3
    deviation = np.sqrt((2 / m**2 + 6 / m**3) / n)
    assert factors.var() == pytest.approx(1 / m, abs=4 * deviation)


def test_the_clipped_means_are_those_that_were_measured_in_veins() -> None:
    assert [round(mean, 3) for mean in CLIPPED_MEAN.values()] == [0.586, 0.692, 0.825]


@pytest.mark.parametrize("m", list(CLIPPED_MEAN))
def test_clipped_fading_never_amplifies_and_has_the_known_mean(library: Library, m: float) -> None:
    scene = row_of_cars([100.0 + k for k in range(100)])
    factors = _factors(library, scene, fading_far_m=m, fading_clipped=True)
    assert factors.max() <= 1 + 1e-12
    assert 0.34 < (factors > 1 - 1e-12).mean() < 0.45
    error = factors.std() / np.sqrt(factors.size)
    assert factors.mean() == pytest.approx(CLIPPED_MEAN[m], abs=4 * error)


def test_the_shape_changes_at_its_distance(library: Library) -> None:
    scene = row_of_cars([40.0, 79.0, 82.0, 120.0])
    factors = _factors(library, scene, 2000, fading_near_m=20.0, fading_far_m=0.5)
    assert (factors.var(axis=0) > 0.5).tolist() == [False, False, True, True]


def test_frames_and_receivers_fade_independently(library: Library) -> None:
    factors = _factors(library, row_of_cars([100.0, 101.0]), 2000)
    assert abs(np.corrcoef(factors[:, 0], factors[:, 1])[0, 1]) < 4 / np.sqrt(2000)
    assert abs(np.corrcoef(factors[1:, 0], factors[:-1, 0])[0, 1]) < 4 / np.sqrt(2000)


def test_each_hop_fades_anew(library: Library) -> None:
    scene = Scene(vehicles=[Vehicle(id=k, position=(100.0 * k, 0.0, 0.0)) for k in range(3)])
    records = [packet(k, 0, to=1, via=[2], time=2 * k * MS) for k in range(500)]
    with Channel(library, scene, **NAKAGAMI) as channel:
        received = channel.step(0.0, 1.0, records)
    power = {(r["packet"], r["hop"]): r["power_dbm"] for r in received if r["receiver"] == 1}
    both = np.array([(power[k, 0], power[k, 1]) for k in range(500) if (k, 1) in power])
    assert len(both) > 400
    assert abs(np.corrcoef(both.T)[0, 1]) < 4 / np.sqrt(len(both))


def test_draws_do_not_depend_on_the_step_size(library: Library) -> None:
    scene = row_of_cars([100.0, 300.0, 700.0])
    records = [packet(k, k % 4, time=k * MS // 3) for k in range(100)]
    found = []
    for steps in (1, 7, 40):
        with Channel(library, scene, **{**NAKAGAMI, "medium_access": True}) as channel:
            cuts = [round(0.06 * k / steps, 9) for k in range(steps + 1)]
            found.append(run(channel, cuts, records)[0].tobytes())
    assert found[0] == found[1] == found[2]


def test_draws_do_not_depend_on_other_vehicles(library: Library) -> None:
    cars = row_of_cars([100.0, 300.0, 700.0]).vehicles
    records = [packet(k, 3, time=k * MS) for k in range(50)]
    found = []
    for vehicles in (cars, [cars[0], cars[1], Vehicle(id=2), cars[3]], [cars[1], cars[3]]):
        with Channel(library, Scene(vehicles=vehicles), **NAKAGAMI) as channel:
            received = channel.step(0.0, 0.1, records)
        found.append(received[received["receiver"] == 1].tobytes())
    assert found[0] == found[1] == found[2]


def test_another_seed_draws_otherwise(library: Library) -> None:
    scene = row_of_cars([100.0])
    one, other = (_factors(library, scene, seed=seed) for seed in (1, 2**64 - 1))
    assert abs(np.corrcoef(one[:, 0], other[:, 0])[0, 1]) < 4 / np.sqrt(FRAMES)


def test_without_fading_its_parameters_change_nothing(library: Library) -> None:
    scene = row_of_cars([100.0, 300.0, 700.0])
    records = [packet(k, k % 4, time=k * MS // 3) for k in range(100)]
    found = []
    for parameters in ({}, {"fading_near_m": 0.5, "fading_far_m": 9.0, "fading_clipped": True}):
        with Channel(library, scene, **parameters) as channel:
            found.append(channel.step(0.0, 0.1, records).tobytes())
    assert found[0] == found[1]


def test_a_mean_power_below_the_sensitivity_is_heard_now_and_then(library: Library) -> None:
    """The bound on fading keeps links whose mean is too weak; none is missed."""
    scene = row_of_cars([500.0])  # mean -75.8 dBm
    parameters = {**NAKAGAMI, "sensitivity": -72.0, "fading_far_m": 1.0}
    with Channel(library, scene, **parameters, weak_receptions=False) as channel:
        heard = channel.step(0.0, 2.0, [packet(k, 0, time=k * MS) for k in range(2000)])
    with Channel(library, scene, **parameters) as channel:
        told = channel.step(0.0, 2.0, [packet(k, 0, time=k * MS) for k in range(2000)])
    assert heard.tobytes() == told[told["power_dbm"] >= -72].tobytes()
    expected = np.exp(-(10 ** ((-72 + 75.85) / 10)))  # exponential power for m = 1
    assert len(heard) / 2000 == pytest.approx(expected, abs=4 * np.sqrt(expected / 2000))
