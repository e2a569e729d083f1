"""Between samples: where road users are, who is there, and under which number."""

import math
from pathlib import Path

import numpy as np
import pytest

from adapters.replay.motion import Interpolation, between
from adapters.replay.tracks import SAMPLE
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Signals
from orchestrator.testing import check_component
from tests.adapters.traces import Sample, array, entered, replay, states, write_csv, write_fcd


def straight(ends: float = 4.0, period: float = 0.5) -> list[Sample]:
    """At 10 m/s on a heading of 30 degrees from north."""
    times = np.arange(round(ends / period) + 1) * period
    ahead = np.array([math.sin(math.radians(30.0)), math.cos(math.radians(30.0))])
    return [
        Sample(id="a", time=time, x=10.0 * time * ahead[0], y=10.0 * time * ahead[1], heading=30.0)
        for time in times.tolist()
    ]


@pytest.mark.parametrize("step", ["0.01", "0.07", "0.1", "0.3", "0.5", "0.7", "1.3"])
def test_straight_at_constant_speed_is_exact_at_any_step(tmp_path: Path, step: str) -> None:
    component = replay(write_fcd(tmp_path / "a.xml", straight()))
    count = int(4.0 / float(step))
    found = list(states(component, step, count))
    ahead = np.array([math.cos(math.radians(60.0)), math.sin(math.radians(60.0))])
    for k, signals in enumerate(found):
        way = 10.0 * k * float(step) - 2.5  # the body's centre is half its length behind the front
        np.testing.assert_allclose(array(signals, "position")[0, :2], way * ahead, atol=1e-9)
        np.testing.assert_allclose(array(signals, "velocity")[0], 10.0 * ahead, atol=1e-9)
        assert array(signals, "heading")[0] == pytest.approx(math.radians(60.0), abs=1e-12)


def test_a_time_at_which_nobody_is_seen_interrupts_nobody(tmp_path: Path) -> None:
    """At 10 m/s to the east: seen at 0 s and 1 s, half-way at 0.5 s, where the file is empty."""
    place = 'y="0" angle="90" speed="10" type="bus"'
    file = tmp_path / "a.xml"
    file.write_text(
        f'<fcd-export><timestep time="0"><vehicle id="a" x="6" {place}/></timestep>'
        '<timestep time="0.5"/>'
        f'<timestep time="1"><vehicle id="a" x="16" {place}/></timestep></fcd-export>'
    )
    found = list(states(replay(file), "0.25", 4))
    ahead = [array(signals, "position")[:, 0].tolist() for signals in found]
    assert ahead == [[0.0], [2.5], [5.0], [7.5], [10.0]]


def test_between_the_bumper_and_the_centre_lies_half_the_length(tmp_path: Path) -> None:
    headings = {"a": 0.0, "b": 90.0, "c": 180.0, "d": 270.0}
    samples = [
        Sample(id=name, time=0.0, x=1.0, y=2.0, heading=heading, type="bus")
        for name, heading in headings.items()
    ]
    (found,) = states(replay(write_fcd(tmp_path / "a.xml", samples)), "0.1", 0)
    expected = [[1.0, -4.0], [-5.0, 2.0], [1.0, 8.0], [7.0, 2.0]]  # a bus is 12 m long
    np.testing.assert_allclose(array(found, "position")[:, :2], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("convention", "written"),
    [
        ("math-deg", 150.0),
        ("compass-deg", -60.0),
        ("compass-deg", 300.0),
        ("math-rad", 5 / 6 * np.pi),
    ],
)
def test_conventions_of_tables_say_the_same(
    tmp_path: Path, convention: str, written: float
) -> None:
    file = write_csv(tmp_path / "a.csv", [Sample(id="a", time=0.0, x=3.0, heading=written)])
    (centre,) = states(replay(file, heading=convention), "0.1", 0)
    (front,) = states(replay(file, heading=convention, reference="front"), "0.1", 0)
    assert array(centre, "heading")[0] == pytest.approx(math.radians(150.0))
    np.testing.assert_array_equal(array(centre, "position")[0], [3.0, 0.0, 0.0])
    ahead = array(centre, "position")[0] - array(front, "position")[0]
    np.testing.assert_allclose(ahead, [-2.5 * math.sqrt(0.75), 1.25, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "between"), [(170.0, -170.0, -180.0), (-170.0, 170.0, -180.0), (10, 30, 20)]
)
def test_a_heading_turns_on_the_shorter_arc(
    tmp_path: Path, first: float, second: float, between: float
) -> None:
    samples = [
        Sample(id="a", time=0.0, heading=first, speed=2.0),
        Sample(id="a", time=1.0, heading=second, speed=6.0),
    ]
    component = replay(write_csv(tmp_path / "a.csv", samples))
    found = list(states(component, "0.25", 4))[2]
    turned = math.degrees(array(found, "heading")[0]) - between
    assert (turned + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(*array(found, "velocity")[0]) == pytest.approx(4.0)


@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_samples_stay_as_they_are(interpolation: Interpolation) -> None:
    """What is between two samples is an array of its own; the sample itself is exact."""
    last, following = np.zeros(1, SAMPLE), np.zeros(1, SAMPLE)
    last["heading"], following["time"] = 0.1, 1000
    following["center"], following["speed"], following["heading"] = (4.0, 8.0), 2.0, 0.3
    before = last.copy(), following.copy()
    found = between(last, following, 250, interpolation)
    is_moving = interpolation == "linear"
    assert found["center"].tolist() == ([[1.0, 2.0]] if is_moving else [[0.0, 0.0]])
    assert found["heading"].tolist() == pytest.approx([0.15 if is_moving else 0.1])
    found["speed"] = 99.0
    for samples, kept in zip((last, following), before, strict=True):
        assert bool((samples == kept).all())
    assert bool((between(last, following, 0, interpolation) == last).all())


@pytest.mark.parametrize("moved", [0.0, 0.02, 10.0])
def test_who_stands_creeps_or_is_teleported_has_no_degrees(tmp_path: Path, moved: float) -> None:
    """Only 1e-6 to 1e-3 of what is driven are degrees; single road users may seem to have some."""
    samples = [
        sample
        for t in range(6)
        for sample in (
            Sample(id="stands", time=t, x=5, speed=0),
            Sample(id="odd", time=t, x=1e-5 * t),
            Sample(id="a", time=t, y=moved * t),
            Sample(id="b", time=t, y=moved * t + 80 * (t > 3)),
        )
    ]
    assert len(list(states(replay(write_csv(tmp_path / "a.csv", samples)), "1", 5))) == 6


@pytest.mark.parametrize("step", [0.01, 1.0])
@pytest.mark.parametrize("latitude", [0, 48, 80])
def test_degrees_are_refused_whatever_the_step(tmp_path: Path, step: float, latitude: int) -> None:
    """10 m/s to the east."""
    change = math.degrees(10 * step / 6.371e6 / math.cos(math.radians(latitude)))
    samples = [Sample(id="a", time=k * step, x=11 + k * change, y=latitude) for k in range(50)]
    with pytest.raises(ComponentTypeError, match="`x` and `y` are degrees"):
        replay(write_csv(tmp_path / "a.csv", samples))


def test_hold_shows_the_last_sample(tmp_path: Path) -> None:
    component = replay(write_fcd(tmp_path / "a.xml", straight(1.0)), interpolation="hold")
    places = [array(s, "position")[0].tolist() for s in states(component, "0.25", 4)]
    assert places[0] == places[1] != places[2] == places[3] != places[4]


def presence(samples: list[Sample], path: Path, **parameters: float) -> list[list[int]]:
    component = replay(write_csv(path, samples), **parameters)
    return [array(signals, "id").tolist() for signals in states(component, "0.5", 10)]


def test_everyone_is_there_from_the_first_to_the_last_sample(tmp_path: Path) -> None:
    samples = [Sample(id="frame", time=t) for t in (0.0, 5.0)]
    samples += [Sample(id="b", time=t) for t in (1.2, 2.0, 2.7)]
    samples.sort(key=lambda sample: sample.time)
    found = presence(samples, tmp_path / "a.csv", maximum_gap=5.0)
    assert found == [[0]] * 3 + [[0, 1]] * 3 + [[0]] * 5


def test_after_a_gap_somebody_else_has_the_name(tmp_path: Path) -> None:
    """The gaps of `b` are exactly `maximum_gap`, and a nanosecond more."""
    times = {"a": range(6), "b": (0.0, 1.0, 2.0, 3.000_000_001, 4.0)}
    samples = [Sample(id=name, time=t) for name, those in times.items() for t in those]
    samples.sort(key=lambda sample: sample.time)
    found = presence(samples, tmp_path / "a.csv", maximum_gap=1.0)
    assert found == [[0, 1]] * 5 + [[0]] * 2 + [[0, 2]] * 2 + [[0]] * 2


def test_entered_names_those_who_were_not_there(tmp_path: Path) -> None:
    samples = [Sample(id="a", time=0.0), Sample(id="b", time=0.0, type="truck")]
    samples += [Sample(id="a", time=1.0), Sample(id="a", time=2.0), Sample(id="b", time=2.0)]
    component = replay(write_csv(tmp_path / "a.csv", samples), maximum_gap=1.0)
    found = [entered(signals) for signals in states(component, "0.5", 4)]
    both = [(0, "a", "passenger"), (1, "b", "truck")]
    assert found == [both, [], [], [], [(2, "b", "passenger")]]


def test_numbers_and_equipment_depend_neither_on_the_start_nor_on_the_step(tmp_path: Path) -> None:
    """Twenty road users, each for 1.5 s, half with a radio: by seed, whenever one looks."""
    samples = [Sample(id=f"v{k}", time=0.5 * (k + j)) for k in range(20) for j in range(4)]
    samples.sort(key=lambda sample: (sample.time, sample.id))
    file = write_csv(tmp_path / "a.csv", samples)

    def told(step: str, count: int, start: str = "0", share: float = 0.5) -> dict[int, bool]:
        component = replay(file, radio_share=share)
        return {
            number: equipped
            for signals in states(component, step, count, start)
            for number, equipped in zip(
                array(signals, "id").tolist(), array(signals, "equipped").tolist(), strict=True
            )
        }

    whole = told("0.1", 110)
    assert list(whole) == list(range(20))
    assert 4 <= sum(whole.values()) <= 16
    assert told("0.5", 22) == whole
    later = told("0.1", 60, "5")
    assert min(later) == 7  # the last samples of 0 to 6 are before 5 s
    assert later == {number: whole[number] for number in later}
    more = told("0.1", 110, share=0.8)
    assert all(more[number] for number in whole if whole[number])


def test_only_motor_vehicles_are_equipped_unless_wanted(tmp_path: Path) -> None:
    kinds = ("passenger", "motorcycle", "bicycle", "pedestrian")
    file = write_csv(tmp_path / "a.csv", [Sample(id=kind, time=0.0, type=kind) for kind in kinds])
    (found,) = states(replay(file, lidar_share=1.0), "0.1", 0)
    assert array(found, "body").tolist() == [0, 6, 7, 8]
    assert array(found, "equipped").tolist() == [True, True, False, False]
    assert array(found, "lidar").tolist() == [True, True, False, False]
    (found,) = states(replay(file, equip_persons=True), "0.1", 0)
    assert array(found, "equipped").all()
    assert not array(found, "lidar").any()


def test_offset_shows_a_later_part(tmp_path: Path) -> None:
    file = write_fcd(tmp_path / "a.xml", straight())
    whole: list[Signals] = list(states(replay(file), "0.1", 40))
    part = list(states(replay(file, offset=1.5), "0.1", 20))
    for early, late in zip(whole[15:], part, strict=False):
        np.testing.assert_array_equal(array(early, "position"), array(late, "position"))
    shifted = list(states(replay(file, offset=-57600.0), "0.1", 40, "57600"))
    for early, late in zip(whole, shifted, strict=True):
        np.testing.assert_array_equal(array(early, "position"), array(late, "position"))


def test_the_contract_is_kept(tmp_path: Path) -> None:
    samples = straight() + [Sample(id="b", time=t, type="bicycle") for t in (1.0, 1.5, 3.5, 4.0)]
    samples.sort(key=lambda sample: sample.time)
    component = replay(write_csv(tmp_path / "a.csv", samples), lidar_share=0.5, radio_share=0.5)
    check_component(component, steps=12, h=300_000_000, seed=3)
