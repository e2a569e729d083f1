"""Clocks that are off: what is drawn, and what the ego makes of times in messages."""

from pathlib import Path

import numpy as np
import pytest

import scenarios
from fmus.facilities import AlwaysOnFacilities
from fmus.facilities.clocks import Clocks
from fmus.facilities.received import Received
from fmus.messages.apm import Apm, decode, encode, shifted, split
from fmus.messages.features import FeaturesMessage, read_features
from fmus.messages.records import APM_CELL, OBJECT, SENSOR_DATA, unframe
from orchestrator.cli import main
from orchestrator.randomness import stream
from tests.fmus.facilities.world import EGO, SHARER, Run, delivered, objects_of

MS = 1_000_000
AGE = 1000 * MS


def apm(time: int) -> bytes:
    cells = np.arange(6, dtype=APM_CELL).reshape(2, 3)
    position = np.array([3.0, 4.0])
    return encode(
        Apm(
            vehicle=7,
            time=time,
            position=position,
            heading=0.5,
            center=position,
            cell=5.0,
            cells=cells,
        )
    )


def objects(time: int) -> np.ndarray:
    rows = np.zeros(2, OBJECT)
    rows["time"], rows["instance"] = time, (1, 2)
    return rows


def features(time: int) -> FeaturesMessage:
    return FeaturesMessage(
        vehicle=7,
        time=time,
        position=np.zeros(3),
        heading=0.0,
        capacity=1,
        dimensions=0,
        keypoints=np.ones((1, 3), np.float32),
    )


def test_errors_are_normal_with_the_deviation_that_was_asked_for() -> None:
    clocks = Clocks(stream(1, "facilities"), 0.02)
    offsets = np.array([clocks.offset(vehicle) for vehicle in range(4000)]) / 1e9
    assert offsets.mean() == pytest.approx(0.0, abs=3 * 0.02 / np.sqrt(4000))
    assert offsets.std() == pytest.approx(0.02, rel=3 / np.sqrt(2 * 4000))
    assert (np.abs(offsets) > 0.04).mean() == pytest.approx(0.0455, abs=0.01)


def test_an_error_depends_on_seed_and_vehicle_only() -> None:
    rng = stream(1, "facilities")
    first = Clocks(rng, 0.02)
    some = [first.offset(vehicle) for vehicle in (5, 3)]
    rng.random(100)  # others draw in between
    again = Clocks(rng, 0.02)
    assert [again.offset(vehicle) for vehicle in (3, 4, 5)][::2] == some[::-1]
    assert Clocks(stream(2, "facilities"), 0.02).offset(5) != some[0]
    assert Clocks(rng, 0.04).offset(5) == pytest.approx(2 * some[0], abs=1)


def test_nothing_is_drawn_from_the_stream_of_the_component() -> None:
    rng, untouched = stream(1, "facilities"), stream(1, "facilities")
    Clocks(rng, 0.02).offset(5)
    assert rng.random() == untouched.random()


def test_a_lead_is_the_difference_of_two_errors() -> None:
    clocks = Clocks(stream(1, "facilities"), 0.02)
    assert clocks.lead(3, 5) == clocks.offset(3) - clocks.offset(5) == -clocks.lead(5, 3)
    assert clocks.lead(3, 3) == 0
    assert Clocks(stream(1, "facilities"), 0.0).lead(3, 5) == 0


@pytest.mark.parametrize("lead", [30 * MS, -30 * MS])
def test_times_in_messages_are_off_by_the_lead(lead: int) -> None:
    received = Received(AGE, 1, {7: lead}.__getitem__)
    received.keep_apm(7, 110 * MS, apm(100 * MS))
    received.replace_objects(7, 110 * MS, objects(100 * MS))
    received.add_keypoints(features(100 * MS), np.ones(1, np.bool_))
    found = received.outputs(150 * MS)
    assert decode(split(bytes(found["received.apms"]))[0]).time == 100 * MS + lead
    rows = unframe("OBJS", found["received.objects"], OBJECT)
    assert rows["time"].tolist() == [100 * MS + lead] * 2
    assert [m.time for m in read_features(bytes(found["received.features"]))] == [100 * MS + lead]
    received.update_objects(7, objects(120 * MS))
    rows = unframe("OBJS", received.outputs(150 * MS)["received.objects"], OBJECT)
    assert rows["time"].tolist() == [120 * MS + lead] * 2


def test_what_a_slow_clock_stamped_is_forgotten_as_much_earlier() -> None:
    received = Received(AGE, 1, {7: -30 * MS}.__getitem__)
    received.keep_apm(7, 0, apm(0))
    received.replace_objects(7, 0, objects(0))
    last = AGE - 30 * MS
    assert len(split(bytes(received.outputs(last)["received.apms"]))) == 1
    assert len(unframe("OBJS", received.outputs(last)["received.objects"], OBJECT)) == 2
    assert split(bytes(received.outputs(last + 1)["received.apms"])) == []
    assert len(unframe("OBJS", received.outputs(last + 1)["received.objects"], OBJECT)) == 0


def test_what_was_told_is_not_changed_at_its_source() -> None:
    rows, message = objects(100), apm(100)
    received = Received(AGE, 1, lambda _: 30)
    received.replace_objects(7, 110, rows)
    received.keep_apm(7, 110, message)
    assert rows["time"].tolist() == [100, 100]
    assert message == apm(100)


def test_a_shifted_apm_differs_in_its_time_only() -> None:
    assert shifted(apm(100), 30) == apm(130)


def told(error: float) -> tuple[int, np.ndarray]:
    """The time of an object that a sharer's scan at 0 s had, as the ego has it, and all packets."""
    run = Run(AlwaysOnFacilities(AlwaysOnFacilities.Parameters(clock_error=error)))
    packets = run.step(objects=objects_of(SHARER))
    data = packets[packets["kind"] == SENSOR_DATA]
    run.step(receptions=delivered(data[data["source"] == SHARER], EGO))
    rows = unframe("OBJS", run.output("received.objects"), OBJECT)
    assert len(rows) == 2
    return int(rows["time"][0]), packets


def test_the_ego_has_times_by_the_difference_of_both_clocks_and_packets_keep_theirs() -> None:
    clocks = Clocks(np.random.default_rng(3), 0.02)  # the stream that `Run` sets up
    right, packets = told(0.0)
    off, same = told(0.02)
    assert right == 0
    assert off == clocks.lead(SHARER, EGO) != 0
    np.testing.assert_array_equal(packets, same)


def test_an_error_that_is_no_deviation_is_refused_at_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = tmp_path / "wrong.yaml"
    base = Path(scenarios.__file__).with_name("red_light.yaml")
    scenario.write_text(
        f"schema: 1\nextends: {base}\ntitle: t\ndescription: d\n"
        "components:\n  facilities:\n    parameters: {clock_error: -1 ms}\n"
    )
    assert main(["check", str(scenario)]) == 2
    problem = "wrong.yaml:7:31: components.facilities.parameters.clock_error: must be at least 0 s"
    assert problem in capsys.readouterr().out
