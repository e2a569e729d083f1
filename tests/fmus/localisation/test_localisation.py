"""The component: scans come with the poses that their vehicles believe to have."""

import numpy as np
import pytest

from fmus.localisation import Localisation
from fmus.messages.records import FRAME, SENSOR, unframe
from orchestrator.component import Component
from orchestrator.registry import component_type
from orchestrator.signal import Array, Signals
from orchestrator.testing import check_component
from tests.fmus.driving.network.world import PERIOD, turn

VEHICLES = (2, 5, 9)


def scans(k: int, *vehicles: int) -> bytes:
    """The scans of some vehicles at the time number `k`."""
    return turn(k, {vehicle: (0.5 * k, float(vehicle)) for vehicle in vehicles})


def driven(
    k: int, present: tuple[int, ...] = VEHICLES, seeing: tuple[int, ...] = (2, 9)
) -> Signals:
    return {"vehicle.id": np.array(present, np.int64), "points": scans(k, *seeing)}


def localisation(**parameters: object) -> Component:
    made = component_type("localisation").create("localisation", parameters)
    made.setup(0, np.random.default_rng(5))
    return made


def stepped(component: Component, k: int, inputs: Signals) -> Signals:
    component.step(inputs, (k - 1) * PERIOD, PERIOD)
    return component.outputs()


def poses(points: object) -> Array:
    """x, y [m] and heading [rad] of each sensor, shape (sensor, 3)."""
    sensors = unframe("LPTS", bytes(points), SENSOR)  # type: ignore[call-overload]
    return np.column_stack([sensors["position"][:, :2], sensors["heading"]])


def off(outputs: Signals) -> dict[int, list[float]]:
    """By how much each vehicle is wrong: x, y [m] and heading [rad]."""
    position = np.asarray(outputs["pose_error.position"])
    table = np.column_stack([position, np.asarray(outputs["pose_error.heading"])])
    vehicles = np.asarray(outputs["pose_error.vehicle"]).tolist()
    return dict(zip(vehicles, table.tolist(), strict=True))


def test_contract() -> None:
    component = localisation(position_error=1.0, heading_error=0.02)
    check_component(component, steps=5, h=PERIOD, inputs=lambda t: driven(t // PERIOD))


def test_by_default_everybody_knows_where_he_is() -> None:
    given = driven(1)
    outputs = stepped(localisation(), 1, given)
    assert outputs["located.points"] == given["points"]
    assert off(outputs) == {vehicle: [0.0, 0.0, 0.0] for vehicle in VEHICLES}


def test_sensors_are_where_their_vehicles_believe_and_nothing_else_changes() -> None:
    component = localisation(position_error=1.5, heading_error=0.03)
    for k in (1, 2, 3):
        given = driven(k)
        outputs = stepped(component, k, given)
        points, measured = bytes(outputs["located.points"]), bytes(given["points"])
        wrong = off(outputs)
        assert list(wrong) == list(VEHICLES)
        assert all(abs(e) > 1e-4 for one in wrong.values() for e in one)
        moved = poses(points) - poses(measured)
        np.testing.assert_allclose(moved, [wrong[2], wrong[9]], rtol=0, atol=1e-12)
        before, after = (unframe("LPTS", each, SENSOR) for each in (measured, points))
        for name in ("vehicle", "time", "pitch", "roll", "first", "count"):
            np.testing.assert_array_equal(after[name], before[name])
        np.testing.assert_array_equal(after["position"][:, 2], before["position"][:, 2])
        tail = FRAME.itemsize + before.nbytes
        assert (len(before) > 0, points[tail:]) == (True, measured[tail:])


def test_a_scan_keeps_the_pose_that_it_came_with() -> None:
    """The errors go on; a scan that stays on the input is not a new one."""
    component = localisation(position_error=1.0)
    first = stepped(component, 1, driven(1))
    held, wrong = first["located.points"], off(first)
    later = stepped(component, 2, {**driven(2), "points": driven(1)["points"]})
    assert later["located.points"] == held
    assert off(later) != wrong


def test_who_has_left_still_has_his_last_scan() -> None:
    """Traffic may be stepped more often than the lidar."""
    component = localisation(position_error=1.0)
    outputs = stepped(component, 1, driven(1, present=(2, 5)))
    assert list(off(outputs)) == [2, 5]
    assert (np.abs(poses(outputs["located.points"]) - poses(scans(1, 2, 9)))[:, :2] > 0).all()


def test_the_first_scans_come_at_the_start() -> None:
    component = localisation(position_error=1.0)
    component.initialise(driven(0))
    outputs = component.outputs()
    assert poses(outputs["located.points"]).shape == (2, 3)
    (x, y, _), *_ = off(outputs).values()
    np.testing.assert_allclose(
        (poses(outputs["located.points"]) - poses(scans(0, 2, 9)))[0], [x, y, 0]
    )


def test_the_seed_is_drawn_or_given() -> None:
    def wrong(rng: int, **parameters: object) -> dict[int, list[float]]:
        component = component_type("localisation").create("localisation", parameters)
        component.setup(0, np.random.default_rng(rng))
        return off(stepped(component, 1, driven(1)))

    drawn = [wrong(rng, position_error=1.0) for rng in (1, 1, 2)]
    assert (drawn[0] == drawn[1], drawn[0] == drawn[2]) == (True, False)
    given = [wrong(rng, position_error=1.0, seed=7) for rng in (1, 2)]
    assert given[0] == given[1]
    assert given[0] not in drawn


def test_nobody_sees_anything_and_nobody_is_there() -> None:
    component = localisation(position_error=1.0)
    nothing: Signals = {"vehicle.id": np.empty(0, np.int64), "points": b""}
    outputs = stepped(component, 1, nothing)
    assert (outputs["located.points"], off(outputs)) == (b"", {})
    assert list(off(stepped(component, 2, driven(2)))) == list(VEHICLES)
    assert stepped(component, 3, {**driven(3), "points": b""})["located.points"] == b""


def test_what_is_no_scan_is_refused() -> None:
    component = localisation(position_error=1.0)
    with pytest.raises(ValueError, match="not a `LPTS` frame of version 1"):
        stepped(component, 1, {**driven(1), "points": b"no scans, whatever else"})


def test_its_class_is_what_is_installed() -> None:
    assert isinstance(localisation(), Localisation)
