"""What a vehicle believes of its pose is off by stationary Gauss-Markov errors of its own."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.localisation import Accuracy, Offsets, PoseErrors
from orchestrator.signal import Array

INTERVAL = 100_000_000  # between steps [ns]


def accuracy(position: float = 1.0, heading: float = 1.0, seconds: float = 1.0) -> Accuracy:
    return Accuracy(position=position, heading=heading, correlation=round(seconds * 1e9))


def flat(offsets: Offsets) -> Array:
    """Of x, y [m] and heading [rad], shape (vehicle, 3)."""
    return np.column_stack([offsets.position, offsets.heading])


def history(given: Accuracy, vehicles: Sequence[int], steps: int, seed: int = 0) -> Array:
    """The errors at each step, shape (step, vehicle, 3)."""
    process = PoseErrors(given, seed)
    return np.stack([flat(process.at(np.array(vehicles), k * INTERVAL)) for k in range(steps)])


@pytest.mark.parametrize("correlation_time", [0.0, 0.25, 2.0])
def test_variance_and_autocorrelation_are_those_of_a_gauss_markov_process(
    correlation_time: float,
) -> None:
    """(1 + b t) exp(-b t), or nothing at all if tau is 0, at every lag, from the first step on."""
    steps, vehicles = 80, 150
    found = history(accuracy(1.5, 0.02, correlation_time), range(vehicles), steps, seed=4)
    unit = found / (1.5, 1.5, 0.02)
    # independent histories: all vehicles and coordinates; along time they are correlated
    samples = 3 * vehicles
    memory = max(1.0, 3e9 * correlation_time / INTERVAL)
    tolerance = 4.5 / np.sqrt(samples * steps / memory)
    assert unit.mean() == pytest.approx(0.0, abs=tolerance)
    assert (unit**2).mean() == pytest.approx(1.0, abs=np.sqrt(2) * tolerance)
    assert (unit**4).mean() == pytest.approx(3.0, abs=np.sqrt(96) * tolerance)
    assert (unit[0] ** 2).mean() == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / samples))
    for lag in (1, 2, 5, 20):
        span = lag * INTERVAL / 1e9
        angle = 2.146 * span / correlation_time if correlation_time else np.inf
        expected = (1 + angle) * np.exp(-angle) if correlation_time else 0.0
        correlation = (unit[lag:] * unit[:-lag]).mean()
        assert correlation == pytest.approx(expected, abs=np.sqrt(2) * tolerance), lag
    # coordinates and vehicles do not follow each other
    assert np.abs((unit[..., 0] * unit[..., 1]).mean()) < 2 * tolerance
    assert np.abs((unit[..., 0] * unit[..., 2]).mean()) < 2 * tolerance
    assert np.abs((unit[:, 1:] * unit[:, :-1]).mean()) < 2 * tolerance


@given(
    st.lists(st.integers(0, 2**31 - 1), min_size=1, max_size=8, unique=True),
    st.lists(st.sets(st.integers(0, 7)), min_size=1, max_size=6),
    st.sampled_from([0.0, 0.3, 5.0]),
)
def test_the_errors_of_a_vehicle_do_not_depend_on_the_others(
    numbers: list[int], presence: list[set[int]], seconds: float
) -> None:
    """Each has those that it has alone, whoever comes and goes, in whatever order they are."""
    given = accuracy(seconds=seconds)
    together, alone = PoseErrors(given, 3), {n: PoseErrors(given, 3) for n in numbers}
    for k, some in enumerate(presence):
        there = [n for i, n in enumerate(numbers) if i in some]
        found = together.at(np.array(there, np.int64), k * INTERVAL)
        assert found.vehicle.tolist() == sorted(there)
        for n in there:
            (row,) = found.rows(np.array([n]))
            expected = flat(alone[n].at(np.array([n]), k * INTERVAL))
            np.testing.assert_array_equal(flat(found)[row], expected[0])


def test_errors_have_a_velocity() -> None:
    """Of the standard deviation b; a process of first order would move by 13 times as much."""
    seconds, vehicles = 30.0, range(400)
    found = history(accuracy(1.0, 1.0, seconds), vehicles, 3)
    steps = np.diff(found, axis=0)
    expected = 2.146 / seconds * INTERVAL / 1e9
    tolerance = 4.5 / np.sqrt(2 * steps[0].size)
    assert steps.std() == pytest.approx(expected, rel=tolerance + 0.01)
    assert np.abs(steps[1] - steps[0]).mean() < 0.2 * np.abs(steps).mean()


def test_position_and_heading_have_their_own_deviations() -> None:
    full = history(accuracy(), range(4), 3)
    np.testing.assert_allclose(history(accuracy(2.0, 0.5), range(4), 3), full * (2.0, 2.0, 0.5))
    assert not history(accuracy(0.0, 1.0), range(4), 3)[..., :2].any()
    assert not history(accuracy(1.0, 0.0), range(4), 3)[..., 2].any()


def test_another_seed_makes_other_errors() -> None:
    first, second = (history(accuracy(), range(3), 3, seed=seed) for seed in (1, 2))
    assert (first != second).all()


def test_one_time_has_one_error_however_often_it_is_asked_for() -> None:
    for seconds in (0.0, 1.0):
        process = PoseErrors(accuracy(seconds=seconds), 0)
        first = flat(process.at(np.arange(2), 3 * INTERVAL))
        np.testing.assert_array_equal(flat(process.at(np.arange(2), 3 * INTERVAL)), first)
        assert (flat(process.at(np.arange(2), 4 * INTERVAL)) != first).all()


@pytest.mark.parametrize(("gap", "is_forgotten"), [(20, False), (21, True)])
def test_after_twenty_correlation_times_a_vehicle_is_a_stranger(
    gap: int, *, is_forgotten: bool
) -> None:
    """What is left of its error by then is lost in rounding, so the memory is what is looked at."""
    tau = INTERVAL
    process = PoseErrors(Accuracy(position=1.0, heading=1.0, correlation=tau), 0)
    process.at(np.arange(1), 0)
    process.at(np.array([5]), gap * tau)
    assert (0 in process.remembered) is not is_forgotten
    alone = PoseErrors(Accuracy(position=1.0, heading=1.0, correlation=tau), 0)
    again, new = process.at(np.arange(1), (gap + 1) * tau), alone.at(np.arange(1), (gap + 1) * tau)
    np.testing.assert_allclose(flat(again), flat(new), rtol=0, atol=1e-15)


def test_the_errors_of_a_seed_are_these() -> None:
    """Studies are of them: other numbers would be other results."""
    process = PoseErrors(accuracy(seconds=30.0), 7)
    first = flat(process.at(np.array([3, 11]), 0))
    second = flat(process.at(np.array([3, 11]), INTERVAL))
    expected = [
        [-0.007805361329944407, 2.463261464044426, -1.8343721857614268],
        [-2.6897136028751376, -0.6448573553770385, -0.3217621510513989],
    ]
    np.testing.assert_array_equal(first, expected)
    expected = [
        [-0.017637761366884972, 2.4634517598108894, -1.821983675316922],
        [-2.6873815706409574, -0.6463636822019565, -0.3127549280522285],
    ]
    np.testing.assert_array_equal(second, expected)
