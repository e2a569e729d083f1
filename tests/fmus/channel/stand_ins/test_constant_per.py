"""The constant packet error rate: which frames are lost, and how strong they seem."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.channel.stand_ins import ConstantPer
from fmus.messages.records import NO_VEHICLE
from orchestrator.errors import ComponentTypeError
from orchestrator.testing import check_component
from tests.fmus.channel.harness import MS, packet, packets
from tests.fmus.channel.stand_ins.harness import Run, outcomes, row_of, scene


def channel(**parameters: float) -> ConstantPer:
    return ConstantPer(ConstantPer.Parameters(**parameters))  # type: ignore[arg-type]


def sent_to_all(per: float, frames: int = 400, vehicles: int = 30, **more: float) -> Run:
    """A run in which vehicle 0 broadcasts."""
    run = Run(channel(per=per, **more))
    broadcasts = packets(packet(k, 0, time=k * MS // 10) for k in range(frames))
    run.steps(scene(row_of(vehicles)), broadcasts, h=10 * MS, until=100 * MS)
    return run


@pytest.mark.parametrize("per", [0.0, 0.05, 0.3, 0.6, 1.0])
def test_the_share_of_lost_frames_is_the_per(per: float) -> None:
    lost = sent_to_all(per).receptions["outcome"] != 0
    assert len(lost) == 400 * 29
    assert abs(lost.mean() - per) <= 4 * math.sqrt(per * (1 - per) / len(lost))


def test_losses_of_receivers_and_frames_are_independent() -> None:
    """Neither along receivers nor along frames is a loss more likely after a loss."""
    lost = (sent_to_all(0.3).receptions["outcome"] != 0).reshape(400, 29)
    for first, second in ((lost[1:], lost[:-1]), (lost[:, 1:], lost[:, :-1])):
        correlation = np.corrcoef(first.ravel(), second.ravel())[0, 1]
        assert abs(correlation) < 4 / math.sqrt(first.size)


@given(st.floats(0, 1), st.floats(0, 1))
def test_what_is_received_at_a_per_is_received_at_every_lower_one(a: float, b: float) -> None:
    low, high = sorted([a, b])
    better, worse = (outcomes(sent_to_all(per, 20, 5).receptions) for per in (low, high))
    assert all(better[key] == "R" for key, letter in worse.items() if letter == "R")


def test_beyond_the_range_nothing_is_noticed() -> None:
    run = Run(channel(per=0.0, range=25.0))
    heard = run.step(scene(row_of(5)), packets([packet(0, 0)]))
    assert outcomes(heard) == {(0, 0, 1): "R", (0, 0, 2): "R", (0, 0, 3): "U", (0, 0, 4): "U"}
    np.testing.assert_array_equal(np.isnan(heard["snir_db"]), [False, False, True, True])


def test_the_range_is_that_between_the_antennas() -> None:
    high = scene({0: (0.0, 0.0), 1: (30.0, 0.0)})
    high["vehicle.antenna_height"] = np.array([1.5, 41.5])  # a triangle 30, 40, 50
    near = Run(channel(per=0.0, range=50.0)).step(high, packets([packet(0, 0)]))
    far = Run(channel(per=0.0, range=49.99)).step(high, packets([packet(0, 0)]))
    assert outcomes(near) == {(0, 0, 1): "R"}
    assert outcomes(far) == {(0, 0, 1): "U"}


def test_power_is_that_of_free_space() -> None:
    """26 dBm over 100 m at 5.9 GHz: 20 log10(4 pi 100 m / 0.050812 m) = 87.865 dB."""
    pair = scene({0: (0.0, 0.0), 1: (100.0, 0.0)})
    (plain,) = Run(channel(per=0.0)).step(pair, packets([packet(0, 0)]))
    assert plain["power_dbm"] == pytest.approx(26 - 87.865, abs=0.001)
    assert plain["snir_db"] == pytest.approx(plain["power_dbm"] + 98)
    (weak,) = Run(channel(per=0.0)).step(pair, packets([packet(0, 0, power_offset=-7.0)]))
    assert weak["power_dbm"] == pytest.approx(plain["power_dbm"] - 7)


def test_coincident_antennas_have_no_loss() -> None:
    (heard,) = Run(channel(per=0.0)).step(scene({0: (0, 0), 1: (0, 0)}), packets([packet(0, 0)]))
    assert heard["power_dbm"] == 26


def test_a_broadcast_is_addressed_to_all_and_a_unicast_to_one() -> None:
    run = Run(channel(per=0.0))
    sent = packets([packet(0, 0), packet(1, 0, to=2)])
    heard = run.step(scene(row_of(4)), sent)
    addressed = {(int(r["packet"]), int(r["receiver"])): bool(r["addressed"]) for r in heard}
    assert addressed == {(0, v): True for v in (1, 2, 3)} | {(1, v): v == 2 for v in (1, 2, 3)}


def test_wrong_parameters_are_named_all_at_once() -> None:
    with pytest.raises(ComponentTypeError) as caught:
        channel(bitrate=7e6, relay_delay=1e-10)
    assert "`bitrate` is 7 Mbit/s; 802.11p has 3, 4.5, 6, 9, 12, 18, 24, 27" in str(caught.value)
    assert "`relay_delay`: 1e-10 s is not a whole number of nanoseconds" in str(caught.value)


def test_contract() -> None:
    """Vehicles that come and go, packets that wait, routes, frames over the ends of steps."""
    h = 700_000

    def inputs(t: int) -> dict[str, object]:
        k = t // h
        here = row_of(3 + k % 3)
        sent = [
            packet(4 * k, 0, time=t + 2 * h),
            packet(4 * k + 1, 1, time=t + h // 2, to=0, via=(2,)),
            packet(4 * k + 2, 2, time=t - h, to=NO_VEHICLE, size=1000),
        ]
        return {**scene(here), "packets": packets(sent)}

    check_component(channel(per=0.3, busy_window=0.001), steps=12, h=h, inputs=inputs)  # type: ignore[arg-type]


def test_losses_to_come_can_be_redrawn_and_frames_on_their_way_arrive() -> None:
    """A step before, one after; frames of 30 ms latency are still on their way between."""
    found = []
    for redrawn in (None, 4, 4):
        run = Run(channel(per=0.5, latency=0.03))
        for k in range(10):
            if k == 3 and redrawn is not None:
                run.component.redraw(np.random.default_rng(redrawn))
            sent = packets(packet(10 * k + n, 0, time=(10 * k + n) * MS) for n in range(10))
            run.step(scene(row_of(20)), sent)
        told = run.receptions
        early = told["packet"] < 30
        found.append([told[early].tobytes(), told[~early].tobytes()])
    assert found[1] == found[2]
    assert found[0][0] == found[1][0]
    assert found[0][1] != found[1][1]
