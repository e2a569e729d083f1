"""What an ego vehicle had when it had to decide: in a world whose truth is known."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from fmus.messages.records import NO_VEHICLE, SENSOR_DATA
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.decision import NUMBERS, Decision
from tests.studies.measures.world import Body, packet, reception, record, seen

EGO, COLLIDER, SHARER, RELAY = 1, 2, 3, 4
ASKED = Decision(
    ego="listener.ego.id", received="listener.received.objects", building="map.building"
)
TRUCK = (8.0, 2.5, 4.0)

COMES = Body(id=COLLIDER, start=(-48.0, 0.0), velocity=(8.0, 0.0), entity="collider")
"""At the origin after 6 s, when the ego is."""
SHARES = Body(id=SHARER, start=(0.0, 30.0), heading=-math.pi / 2, entity="sharer")
BLOCKS = Body(id=8, start=(0.0, 10.0), heading=math.pi / 2, size=TRUCK)
HIDES = Body(id=9, start=(-4.0, -12.0), heading=math.pi / 2, size=(30.0, 2.5, 4.0))
"""Beside the ego's way."""
WORLD = (COMES, SHARES, BLOCKS, HIDES)

DISTANCE = 60.0 - 2.0 - 1.0
"""Of the ego's front from the way of the collider, at 0 s [m]."""
END = (48.0 + 2.0 + 1.0) / 8.0
"""When the collider has left the way of the ego [s]."""
NO_RETURN = END - 0.3 - math.sqrt(2.0 * (10.0 * END - DISTANCE) / 3.0)
"""By the formula: the ego is at 10 m/s and passes behind [s]; 3.95 s."""


def ego(until: float = math.inf) -> Body:
    return Body(id=EGO, start=(0.0, -60.0), velocity=(0.0, 10.0), entity="ego", until=until)


def message(number: int, time: float, **more: int) -> Array:
    """A packet of sensor data from the sharer to the ego [s]."""
    usual = {"destination": EGO, "kind": SENSOR_DATA}
    return packet(number, SHARER, time, **(usual | more))


def arrival(number: int, time: float, hop: int = 0, outcome: str = "R", **more: int) -> Array:
    ends = (RELAY if hop else SHARER, EGO)
    return reception(number, ends, time, outcome, kind=SENSOR_DATA, hop=hop, **more)


def recorded(
    folder: Path,
    bodies: Sequence[Body] = (ego(), *WORLD),
    *,
    packets: Sequence[Array] = (),
    receptions: Sequence[Array] = (),
    objects: Sequence[Array] = (),
    told: Sequence[Array] = (),
) -> Recording:
    return record(
        folder,
        bodies,
        7.0,
        packets=packets,
        receptions=receptions,
        objects=objects,
        shared=(EGO, told),
        buildings=[],
    )


def test_the_point_of_no_return_is_that_of_the_formula(tmp_path: Path) -> None:
    found = ASKED.compute(recorded(tmp_path)).numbers
    assert tuple(found) == NUMBERS
    assert found["no_return_s"] == pytest.approx(NO_RETURN, abs=1e-6)
    assert found["meeting_s"] == pytest.approx(DISTANCE / 10.0, abs=1e-6)
    assert found["braked_before_s"] is None


def test_stronger_brakes_are_needed_later(tmp_path: Path) -> None:
    """With 8 m/s^2 the ego would stop before the way, within 0.1 s and 6.25 m."""
    found = replace(ASKED, deceleration=8.0, reaction=0.1).compute(recorded(tmp_path)).numbers
    assert found["no_return_s"] == pytest.approx((DISTANCE - 1.0 - 6.25) / 10.0, abs=1e-6)


def test_it_is_the_same_for_who_brakes_before_it(tmp_path: Path) -> None:
    """From 3 s on at 5 m/s; a touch of the brakes that costs less than 5 % is none."""
    slower = Body(
        id=EGO, start=(0.0, -45.0), velocity=(0.0, 5.0), entity="ego", since=3.0
    )  # at -30 m at 3 s
    found = ASKED.compute(recorded(tmp_path, (ego(until=3.0), slower, *WORLD))).numbers
    assert found["no_return_s"] == pytest.approx(NO_RETURN, abs=1e-6)
    assert found["braked_before_s"] == pytest.approx(NO_RETURN - 3.0, abs=1e-6)

    touched = Body(
        id=EGO, start=(0.0, -58.8), velocity=(0.0, 9.6), entity="ego", since=3.0
    )  # at -30 m at 3 s
    found = ASKED.compute(recorded(tmp_path / "b", (ego(until=3.0), touched, *WORLD))).numbers
    overshoot = 9.6 * (END - 3.0) - 27.0
    later = END - 0.3 - math.sqrt(2.0 * overshoot / 3.0)
    assert found["no_return_s"] == pytest.approx(later, abs=1e-6)
    assert found["braked_before_s"] is None


def test_what_has_arrived_of_the_scans_before_it(tmp_path: Path) -> None:
    """Scans every 50 ms, a message of each second one, 30 ms later; all but the newest arrive.

    The window from 2.95 to 3.95 s has 20 scans, of which 10 were sent.
    """
    sent = [0.03 + 0.1 * k for k in range(60)]
    packets = [message(k, time) for k, time in enumerate(sent)]
    heard = [arrival(k, t + 0.004, outcome="N" if k == 39 else "R") for k, t in enumerate(sent)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard))
    numbers = found.numbers
    assert (numbers["scans"], numbers["scans_there"], numbers["sent"]) == (20, 9, 10)
    assert numbers["there"] == pytest.approx(9 / 20)
    assert numbers["direct"] == pytest.approx(9 / 10)
    assert numbers["age_s"] == pytest.approx(NO_RETURN - 3.8, abs=1e-6)
    table = found.tables["scans"]
    assert table["is_there"].sum() == 9
    assert table["before_s"][-1] == pytest.approx(NO_RETURN - 3.95, abs=1e-6)
    assert table["arrived_s"][table["is_there"]][-1] == pytest.approx(3.834)


def test_what_comes_after_it_is_not_there(tmp_path: Path) -> None:
    """The message of the scan at 3.5 s takes 0.6 s; the last one before it came in time."""
    packets = [message(0, 2.0), message(1, 3.5)]
    heard = [arrival(0, 2.1), arrival(1, 4.1)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["sent"]) == (0, 1)
    assert found["age_s"] == pytest.approx(NO_RETURN - 2.0, abs=1e-6)


def test_a_message_is_there_when_all_its_packets_are(tmp_path: Path) -> None:
    packets = [message(0, 3.5), message(1, 3.5), message(2, 3.6), message(3, 3.6)]
    heard = [arrival(0, 3.51), arrival(1, 3.52), arrival(2, 3.61), arrival(3, 3.62, outcome="N")]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["sent"], found["direct"]) == (1, 2, 0.5)
    assert found["age_s"] == pytest.approx(NO_RETURN - 3.5, abs=1e-6)


def test_what_a_relay_brings_is_there_and_not_direct(tmp_path: Path) -> None:
    packets = [message(0, 3.5), message(1, 3.6)]
    heard = [arrival(0, 3.51, hop=1), arrival(1, 3.61)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["direct"]) == (2, 0.5)


def test_what_is_only_overheard_is_not_there(tmp_path: Path) -> None:
    """The ego could decode the first hop, but that was for the relay, which lost it."""
    packets = [message(0, 3.5), message(1, 3.6)]
    heard = [arrival(0, 3.51, addressed=0), arrival(1, 3.61)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["sent"], found["direct"]) == (1, 2, 1.0)


def test_broadcasts_of_the_sharing_node_are_for_the_ego_too(tmp_path: Path) -> None:
    packets, heard = [message(0, 3.5, destination=NO_VEHICLE)], [arrival(0, 3.51)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["sent"]) == (1, 1)


def test_what_others_get_or_send_does_not_count(tmp_path: Path) -> None:
    """To another, from another, of another kind."""
    packets = [
        message(0, 3.5, destination=RELAY),
        packet(1, RELAY, 3.5, destination=EGO, kind=SENSOR_DATA),
        packet(2, SHARER, 3.5, destination=EGO),
    ]
    heard = [arrival(k, 3.52) for k in range(3)]
    found = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard)).numbers
    assert (found["scans_there"], found["sent"], found["age_s"]) == (0, 0, None)
    assert found["direct"] is None


def test_when_the_ego_first_knew_of_the_other(tmp_path: Path) -> None:
    """Told at 2.5 s by an object within its body; seen by itself at 4.5 s, after it."""
    told = [seen(SHARER, (-48.0 + 8.0 * t, 0.0), t) for t in (2.5, 3.0)]
    own = [seen(EGO, (-48.0 + 8.0 * 4.5, 0.0), 4.5), seen(SHARER, (-40.0, 0.0), 1.0)]
    found = ASKED.compute(recorded(tmp_path, told=told, objects=own)).numbers
    assert found["told_before_s"] == found["known_before_s"]
    assert found["told_before_s"] == pytest.approx(NO_RETURN - 2.5, abs=1e-6)
    assert found["seen_before_s"] == pytest.approx(NO_RETURN - 4.5, abs=1e-6)
    never = ASKED.compute(recorded(tmp_path / "b")).numbers
    assert never["known_before_s"] is None


def test_what_stands_between(tmp_path: Path) -> None:
    """One truck in the link; a second one counts, a car does not, and who is hidden is hidden."""
    found = ASKED.compute(recorded(tmp_path)).numbers
    assert (found["bodies_least"], found["obstructed"], found["in_sight"]) == (1, 1.0, 0.0)
    more = (
        Body(id=10, start=(0.0, 20.0), heading=math.pi / 2, size=TRUCK),
        Body(id=11, start=(0.0, 3.0), heading=math.pi / 2),
    )
    found = ASKED.compute(recorded(tmp_path / "b", (ego(), *WORLD, *more))).numbers
    assert (found["bodies_least"], found["bodies_mean"]) == (2, 2.0)
    free = ASKED.compute(recorded(tmp_path / "c", (ego(), COMES, SHARES))).numbers
    assert (free["bodies_least"], free["obstructed"], free["in_sight"]) == (0, 0.0, 1.0)


def test_who_meets_nobody_has_nothing_to_decide(tmp_path: Path) -> None:
    away = Body(id=COLLIDER, start=(-48.0, 0.0), velocity=(-8.0, 0.0), entity="collider")
    found = ASKED.compute(recorded(tmp_path, (ego(), away, SHARES))).numbers
    assert found == dict.fromkeys(NUMBERS)


def test_an_entity_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no entity `colider`; did you mean `collider`"):
        Decision(ego="listener.ego.id", other="colider").compute(recorded(tmp_path))


def test_the_panel_shows_which_scans_were_there(tmp_path: Path) -> None:
    figure = pytest.importorskip("matplotlib.figure").Figure()
    axes = figure.subplots()
    packets, heard = [message(0, 3.5)], [arrival(0, 3.52)]
    answer = ASKED.compute(recorded(tmp_path, packets=packets, receptions=heard))
    assert answer.panel is not None
    answer.panel(axes)
    there, missing = (line for line in axes.lines if line.get_label() in ("there", "not"))
    assert len(there.get_xdata()) == 1
    assert len(missing.get_xdata()) == 19
    assert set(there.get_ydata()) == {1}
    assert set(missing.get_ydata()) == {0}
