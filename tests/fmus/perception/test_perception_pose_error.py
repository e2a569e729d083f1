"""What a vehicle believes of its pose is off by stationary Gauss-Markov errors of its own."""

import numpy as np
import pytest

from fmus.messages.apm import Float
from tests.fmus.driver import Library, Refused

from .harness import Outputs, Perception
from .scene import Scan, car, cloud, look

SMALL = {"rows": 1, "columns": 1, "layer": False}
INTERVAL = 0.1  # between scans [s]


def scans(vehicles: range, k: int) -> bytes:
    """Scan `k` of vehicles that stand in a row and face in all directions; they see nothing."""
    return cloud(
        *(
            Scan(
                vehicle=v,
                points=np.zeros((0, 3)),
                time=round(k * INTERVAL * 1e9),
                position=(10.0 * v, -3.0 * v, 2.0),
                heading=0.1 * v,
            )
            for v in vehicles
        )
    )


def errors(library: Library, vehicles: range, steps: int, **settings: float) -> Float:
    """Of x, y [m] and heading [rad], shape (step, vehicle, 3), from the APMs' headers."""
    found = np.empty((steps, len(vehicles), 3))
    with Perception(library, **{**SMALL, **settings}) as unit:
        for k in range(steps):
            for i, apm in enumerate(unit.step(scans(vehicles, k)).apms):
                truth = (10.0 * apm.vehicle, -3.0 * apm.vehicle, 0.1 * apm.vehicle)
                found[k, i] = np.array([*apm.position, apm.heading]) - truth
    return found


def bytes_of(result: Outputs) -> tuple[bytes, ...]:
    return (
        result.apms_signal, result.objects_signal, result.centers.tobytes(),
        result.ranges.tobytes(), result.benefits.tobytes(),
    )  # fmt: skip


def sighting(k: int) -> bytes:
    boxes = [car(5, 14 - 0.9 * k, 7), car(6, -20 + 1.3 * k, -5, height=3.0)]
    return cloud(*(look(v, (9.0 * v, 2.0), boxes, time=k * 10**8) for v in (1, 2)))


def test_without_error_nothing_changes_whatever_seed_and_time(library: Library) -> None:
    results = []
    for settings in ({}, {"seed": 7, "pose_error_time": 3.0}):
        with Perception(library, **settings) as unit:
            results.append([bytes_of(unit.step(sighting(k), ego=1)) for k in range(4)])
    assert results[0] == results[1]


@pytest.mark.parametrize("correlation_time", [0.0, 0.25, 2.0])
def test_variance_and_autocorrelation_are_those_of_a_gauss_markov_process(
    library: Library, correlation_time: float
) -> None:
    """exp(-t / tau), or nothing at all if tau is 0, at every lag, from the first scan on."""
    steps, vehicles = 80, range(150)
    found = errors(
        library,
        vehicles,
        steps,
        position_error=1.5,
        heading_error=0.02,
        pose_error_time=correlation_time,
        seed=4,
    )
    unit = found / (1.5, 1.5, 0.02)
    # independent histories: all vehicles and coordinates; along time they are correlated
    samples = 3 * len(vehicles)
    memory = max(1.0, 2 * correlation_time / INTERVAL)
    tolerance = 4.5 / np.sqrt(samples * steps / memory)
    assert unit.mean() == pytest.approx(0.0, abs=tolerance)
    assert (unit**2).mean() == pytest.approx(1.0, abs=np.sqrt(2) * tolerance)
    assert (unit**4).mean() == pytest.approx(3.0, abs=np.sqrt(96) * tolerance)
    assert (unit[0] ** 2).mean() == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / samples))
    for lag in (1, 2, 5, 20):
        expected = np.exp(-lag * INTERVAL / correlation_time) if correlation_time else 0.0
        correlation = (unit[lag:] * unit[:-lag]).mean()
        assert correlation == pytest.approx(expected, abs=np.sqrt(2) * tolerance), lag
    # coordinates and vehicles do not follow each other
    assert np.abs((unit[..., 0] * unit[..., 1]).mean()) < 2 * tolerance
    assert np.abs((unit[..., 0] * unit[..., 2]).mean()) < 2 * tolerance
    assert np.abs((unit[:, 1:] * unit[:, :-1]).mean()) < 2 * tolerance


def test_the_errors_of_a_vehicle_do_not_depend_on_the_others(library: Library) -> None:
    settings = {"position_error": 1.0, "heading_error": 0.1, "pose_error_time": 1.0}
    many = errors(library, range(2, 9), 5, **settings)
    alone = errors(library, range(6, 7), 5, **settings)
    np.testing.assert_array_equal(many[:, 4:5], alone)


def test_another_seed_makes_other_errors(library: Library) -> None:
    settings = {"position_error": 1.0, "pose_error_time": 1.0}
    first, second = (errors(library, range(3), 3, seed=seed, **settings) for seed in (1, 2))
    assert (first[..., :2] != second[..., :2]).all()


def test_one_scan_has_one_error_however_often_it_is_read(library: Library) -> None:
    for correlation_time in (0.0, 1.0):
        settings = {"position_error": 1.0, "pose_error_time": correlation_time}
        with Perception(library, **SMALL, **settings) as unit:
            first = unit.step(scans(range(2), 3)).apms_signal
            assert unit.step(scans(range(2), 3)).apms_signal == first
            assert unit.step(scans(range(2), 4)).apms_signal != first


def test_after_forty_correlation_times_a_vehicle_is_a_stranger(library: Library) -> None:
    settings = {"position_error": 1.0, "pose_error_time": 0.001, **SMALL}
    with Perception(library, **settings) as unit:
        unit.step(scans(range(1), 0))
        later = unit.step(scans(range(1), 1)).apms_signal
    with Perception(library, **settings) as unit:
        assert unit.step(scans(range(1), 1)).apms_signal == later


def test_only_what_depends_on_the_pose_is_off(library: Library) -> None:
    """Cells and layer are as measured; positions follow the believed pose as one body."""
    with Perception(library, offset=7.0) as unit:
        truth = unit.step(sighting(0), ego=1)
    with Perception(library, offset=7.0, position_error=2.0, heading_error=0.0) as unit:
        shifted = unit.step(sighting(0), ego=1)
    with Perception(library, offset=7.0, position_error=2.0, heading_error=0.3) as unit:
        turned = unit.step(sighting(0), ego=1)
    for k, apm in enumerate(truth.apms):
        move = shifted.apms[k].position - apm.position
        assert np.hypot(*move) > 0.01
        np.testing.assert_allclose(shifted.apms[k].center - apm.center, move, atol=1e-12)
        assert shifted.apms[k].heading == apm.heading
        assert turned.apms[k].heading != apm.heading
        ahead = np.array([np.cos(turned.apms[k].heading), np.sin(turned.apms[k].heading)])
        np.testing.assert_allclose(
            turned.apms[k].center, turned.apms[k].position + 7.0 * ahead, atol=1e-9
        )
        for other in (shifted, turned):
            np.testing.assert_array_equal(other.apms[k].cells, apm.cells)
    moves = {apm.vehicle: shifted.apms[k].position - apm.position
             for k, apm in enumerate(truth.apms)}  # fmt: skip
    assert len(truth.objects) == len(shifted.objects) > 0
    for seen, believed in zip(truth.objects, shifted.objects, strict=True):
        assert seen["points"] == believed["points"]
        assert seen["height"] == believed["height"]
        for corner in ("minimum", "maximum"):
            move = believed[corner] - seen[corner]
            np.testing.assert_allclose(move, moves[int(seen["sensor"])], atol=1e-9)
    move = moves[1]
    assert len(truth.ranges) == len(shifted.ranges)
    np.testing.assert_allclose(shifted.centers - truth.centers, [move] * len(truth.ranges))
    np.testing.assert_array_equal(shifted.ranges, truth.ranges)


def test_a_restored_state_continues_with_the_same_errors(library: Library) -> None:
    settings = {"position_error": 1.0, "heading_error": 0.1, "pose_error_time": 1.0, "seed": 3}
    with Perception(library, **SMALL, **settings) as unit:
        for k in range(3):
            unit.step(scans(range(4), k))
        state, time = unit.save(), unit.time
        expected = [bytes_of(unit.step(scans(range(4), k))) for k in range(3, 6)]
    with Perception(library, **SMALL, **settings) as other:
        other.begin()
        other.restore(state)
        other.time = time
        assert [bytes_of(other.step(scans(range(4), k))) for k in range(3, 6)] == expected


def test_a_scan_older_than_the_last_is_refused(library: Library) -> None:
    with Perception(library, **SMALL, position_error=1.0, pose_error_time=1.0) as unit:
        unit.step(scans(range(2), 5))
        with pytest.raises(Refused, match=r"the scan of vehicle 0 at 400000000 ns is older"):
            unit.step(scans(range(2), 4))
