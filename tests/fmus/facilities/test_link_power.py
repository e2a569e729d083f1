"""Received powers: measured where a BSM was received, known to the ego where it was told."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.facilities import Facilities
from fmus.facilities.link_power import STRONGEST, WEAKEST, Announcements, Measurements, Powers
from fmus.messages.records import BSM, RECEPTION, frame, unframe
from tests.fmus.facilities.world import EGO, RELAY, SHARER, Run, delivered

SECOND = 1_000_000_000


def receptions(*samples: tuple[int, int, int, float]) -> Any:
    """`RECEPTION` records of (time, transmitter, receiver, power)."""
    rows = np.zeros(len(samples), RECEPTION)
    for row, (time, transmitter, receiver, power) in zip(rows, samples, strict=True):
        row["time"], row["transmitter"], row["receiver"] = time, transmitter, receiver
        row["power_dbm"] = power
    return rows


@given(st.lists(st.floats(-120, -20), min_size=1, max_size=20), st.integers(0, 19))
def test_the_filter_is_that_of_layer_3(samples: list[float], k: int) -> None:
    """Sample by sample or all at once."""
    expected = samples[0]
    for sample in samples[1:]:
        expected = (1 - 2 ** (-k / 4)) * expected + 2 ** (-k / 4) * sample
    rows = receptions(*[(t, 5, 6, power) for t, power in enumerate(samples)])
    at_once, one_by_one = Measurements(k, SECOND), Measurements(k, SECOND)
    at_once.measure(rows)
    for row in rows:
        one_by_one.measure(row[None])
    np.testing.assert_array_equal(at_once.by(6).power, one_by_one.by(6).power)
    assert float(at_once.by(6).power[0]) == pytest.approx(expected, rel=1e-9)


@given(st.dictionaries(st.tuples(st.integers(0, 9), st.integers(0, 9)), st.floats(-99, -20)))
def test_each_radio_has_its_own_table(links: dict[tuple[int, int], float]) -> None:
    table = Measurements(4, SECOND)
    for (transmitter, receiver), power in links.items():
        table.measure(receptions((0, transmitter, receiver, power)))
    for receiver in range(10):
        mine = {t: power for (t, r), power in sorted(links.items()) if r == receiver}
        measured = table.by(receiver)
        assert (
            dict(zip(measured.transmitter.tolist(), measured.power.tolist(), strict=True)) == mine
        )
        asked = measured.of(np.arange(10))
        assert {t: p for t, p in enumerate(asked.tolist()) if not np.isnan(p)} == mine


@given(
    st.lists(
        st.tuples(
            st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), max_size=8),
            st.lists(st.integers(0, 40), max_size=10),
        ),
        max_size=12,
    )
)
def test_radios_come_and_go_and_each_link_is_its_own(
    steps: list[tuple[list[tuple[int, int]], list[int]]],
) -> None:
    """Whatever radios were expected or have left: one filter per link, forgotten after 3 steps."""
    table = Measurements(4, 3)
    expected: dict[tuple[int, int], tuple[int, float]] = {}
    for now, (links, expected_radios) in enumerate(steps):
        table.meet(np.array(sorted(set(expected_radios)), np.int64))
        samples = [(now, *link, -40.0 - 3 * now - link[0]) for link in links]
        table.measure(receptions(*samples))
        for _, transmitter, receiver, sample in samples:
            time, before = expected.get((transmitter, receiver), (-9, 0.0))
            power = (before + sample) / 2 if time >= now - 4 else sample
            expected[transmitter, receiver] = (now, power)
        table.forget(now)
        receivers = np.arange(41)
        told = table.table(receivers)
        assert (np.diff(told.transmitter) > 0).all()
        fresh = {link: power for link, (time, power) in expected.items() if time >= now - 3}
        rows, columns = np.nonzero(~np.isnan(told.power))
        assert {
            (int(told.transmitter[c]), int(r)): float(told.power[r, c])
            for r, c in zip(rows, columns, strict=True)
        } == pytest.approx(fresh)
        for receiver in (0, 7, 40):
            mine = {t: power for (t, r), power in fresh.items() if r == receiver}
            alone = table.by(receiver)
            assert dict(zip(alone.transmitter, alone.power, strict=True)) == pytest.approx(mine)


def test_an_old_link_is_forgotten_and_starts_anew() -> None:
    table = Measurements(4, SECOND)
    table.measure(receptions((0, 5, 6, -90.0), (1, 7, 6, -80.0)))
    table.forget(SECOND + 1)
    np.testing.assert_array_equal(table.by(6).transmitter, [7])
    table.measure(receptions((2 * SECOND, 5, 6, -50.0)))
    np.testing.assert_array_equal(table.by(6).power, [-50.0, -80.0])


def test_unknown_powers_measure_nothing() -> None:
    table = Measurements(4, SECOND)
    table.measure(receptions((0, 5, 6, np.nan)))
    assert len(table.by(6).power) == 0


@given(st.floats(-300, 50))
def test_announced_powers_are_whole_decibels_of_the_range(power: float) -> None:
    said = float(Powers(transmitter=np.array([1]), power=np.array([power])).announced().power[0])
    assert said == round(said)
    assert said == min(max(round(power), WEAKEST), STRONGEST)


def test_the_newest_announcement_counts_until_it_is_too_old() -> None:
    known = Announcements(SECOND)
    sharers = np.array([5])
    known.receive(9, 20, Powers(transmitter=np.array([5]), power=np.array([-60.0])))
    known.receive(9, 10, Powers(transmitter=np.array([5]), power=np.array([-40.0])))
    np.testing.assert_array_equal(known.links(20, sharers).power, [-60.0])
    assert len(known.links(20, np.array([6])).power) == 0
    assert len(known.links(20, sharers).power) == 1
    assert len(known.links(21 + SECOND, sharers).power) == 0


def heard(packets: Any, receiver: int, power: float) -> Any:
    rows = unframe("RCPT", delivered(packets, receiver), RECEPTION).copy()
    rows["power_dbm"] = power
    return rows


def relay_hears_sharer(run: Run, ego_hears: bool, power: float = -61.4) -> None:  # noqa: FBT001
    """1.5 s in which the relay hears the sharer at `power`, and the ego the relay at -75 dBm."""
    packets = run.step()
    for _ in range(150):
        bsms = packets[packets["kind"] == BSM]
        rows = [heard(bsms[bsms["source"] == SHARER], RELAY, power)]
        if ego_hears:
            rows.append(heard(bsms[bsms["source"] == RELAY], EGO, -75.0))
        packets = run.step(receptions=frame("RCPT", np.concatenate(rows)))


def test_the_ego_knows_what_it_measured_and_what_it_was_told() -> None:
    run = Run(Facilities(Facilities.Parameters()))
    relay_hears_sharer(run, ego_hears=True)
    np.testing.assert_array_equal(run.output("received.bsm.id"), [RELAY])
    np.testing.assert_array_equal(run.output("received.link.transmitter"), [RELAY, SHARER])
    np.testing.assert_array_equal(run.output("received.link.receiver"), [EGO, RELAY])
    np.testing.assert_array_equal(run.output("received.link.power"), [-75.0, -61.0])


def test_what_the_relay_measured_is_unknown_to_an_ego_that_does_not_hear_it() -> None:
    run = Run(Facilities(Facilities.Parameters()))
    relay_hears_sharer(run, ego_hears=False)
    assert len(run.output("received.link.power")) == 0


def test_links_from_vehicles_that_are_no_sharers_are_not_told() -> None:
    run = Run(Facilities(Facilities.Parameters()))
    relay_hears_sharer(run, ego_hears=True)
    run.step(match__sharer=np.array([-1, 77], np.int64))
    np.testing.assert_array_equal(run.output("received.link.transmitter"), [RELAY])


def test_without_known_powers_the_neighbour_is_there_and_its_power_is_not() -> None:
    run = Run(Facilities(Facilities.Parameters()))
    packets = run.step()
    while not (mine := packets[packets["source"] == RELAY]).size:
        packets = run.step()
    run.step(receptions=frame("RCPT", heard(mine, EGO, np.nan)))
    np.testing.assert_array_equal(run.output("received.bsm.id"), [RELAY])
    assert len(run.output("received.link.power")) == 0


@pytest.mark.parametrize("size", [0, 5])
def test_every_announced_neighbour_makes_the_bsm_longer(size: int) -> None:
    """The relay hears one neighbour, the sharer hears none."""
    run = Run(Facilities(Facilities.Parameters(announced_power_size=size)))
    relay_hears_sharer(run, ego_hears=False)
    packets = np.concatenate([run.step() for _ in range(11)])
    bsms = packets[packets["kind"] == BSM]
    assert set(bsms["size"][bsms["source"] == RELAY]) == {200 + size}
    assert set(bsms["size"][bsms["source"] == SHARER]) == {200}
