"""What happens does not depend on how time is cut into steps, nor on who else is there."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.records import OUTCOMES, RECEPTION, unframe
from orchestrator.signal import Array
from tests.fmus.driver import Library, Refused
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import MS, NO_OBSTACLES, Channel, packet, run

# weak radios, so that about half of the frames are lost
WEAK = {"transmit_power": 2.0, "sensitivity": -97.0}


def _town(seed: int = 1, cars: int = 20) -> Scene:
    rng = np.random.default_rng(seed)
    return Scene(
        vehicles=[
            Vehicle(
                id=3 * k,
                position=(*rng.uniform(-300, 300, 2), 0.0),
                heading=rng.uniform(0, 7),
                size=(5.0, 2.0, rng.uniform(1.4, 3.5)),
                equipped=bool(k % 5),
            )
            for k in range(cars)
        ],
        buildings=[
            Building(ring=rectangle(60, 60, 80, 80)),
            Building(ring=rectangle(-60, 0, 40, 9)),
        ],
    )


TOWN = _town()
RADIOS = [v.id for v in TOWN.vehicles if v.equipped]


def _traffic(packets: int = 60) -> list[Array]:
    """Broadcasts and routed packets, many at the same time, some near the ends of steps."""
    rng = np.random.default_rng(2)
    records = []
    for number in range(packets):
        source, relay, other, end = (int(v) for v in rng.choice(RADIOS, 4, replace=False))
        time = int(rng.integers(0, 100)) * MS // 2
        via = [[], [relay], [relay, other]][number % 3]
        records.append(packet(number, source, time=time, to=end if via else -1, via=via))
    return sorted(records, key=lambda r: (int(r["time"]), int(r["id"])))


TRAFFIC = _traffic()
WHOLE = [0.0, 0.08]


def _all(library: Library, cuts: Sequence[float], records: Sequence[Array] = TRAFFIC) -> bytes:
    with Channel(library, TOWN, **WEAK) as channel:
        return run(channel, cuts, records)[0].tobytes()


def test_the_traffic_has_losses_and_relays(library: Library) -> None:
    records = np.frombuffer(_all(library, WHOLE), RECEPTION)
    outcomes = {OUTCOMES[k] for k in records["outcome"]}
    assert outcomes == {"R", "N", "U"}
    assert set(records["hop"].tolist()) == {0, 1, 2}
    assert len(records) > 1000


def test_two_runs_give_equal_bytes_and_another_seed_does_not(library: Library) -> None:
    assert _all(library, WHOLE) == _all(library, WHOLE)
    with Channel(library, TOWN, **WEAK, seed=2) as channel:
        assert run(channel, WHOLE, TRAFFIC)[0].tobytes() != _all(library, WHOLE)


@pytest.mark.parametrize("steps", [8, 80, 800])
def test_equal_steps_of_any_size_give_equal_receptions(library: Library, steps: int) -> None:
    cuts = [k * 0.08 / steps for k in range(steps + 1)]
    assert _all(library, cuts) == _all(library, WHOLE)


@given(st.lists(st.integers(1, 79_999), max_size=12, unique=True))
@settings(max_examples=25)
def test_any_cuts_give_equal_receptions(library: Library, cuts: list[int]) -> None:
    assert _all(library, [0.0, *(c * 1e-6 for c in sorted(cuts)), 0.08]) == _all(library, WHOLE)


def test_packets_ahead_of_their_time_wait(library: Library) -> None:
    with Channel(library, TOWN, **WEAK) as channel:
        early = [channel.step(0.0, 0.02, TRAFFIC)]
        early += [channel.step(t / 100, 0.02, []) for t in (2, 4, 6)]
    assert np.concatenate(early).tobytes() == _all(library, WHOLE)


def test_receptions_come_in_order_and_when_the_frame_has_ended(library: Library) -> None:
    cuts = [k * 0.0007 for k in range(115)]
    with Channel(library, TOWN, **WEAK) as channel:
        _, outputs = run(channel, cuts, TRAFFIC)
    for (begin, end), data in zip(itertools.pairwise(cuts), outputs, strict=True):
        records = unframe("RCPT", data, RECEPTION)
        keys = records[["time", "packet", "hop", "receiver"]].tolist()
        assert keys == sorted(keys)
        assert all(round(begin * 1e9) < r["time"] <= round(end * 1e9) for r in records)


def test_a_late_packet_goes_on_air_at_once(library: Library) -> None:
    with Channel(library, TOWN) as channel:
        channel.step(0.0, 1.0, [])
        late = channel.step(1.0, 0.1, [packet(1, RADIOS[0], time=0)])
        due = channel.step(1.1, 0.1, [packet(2, RADIOS[0], time=1_100_000_000)])
    assert (late["time"] > 1_000_000_000).all()
    assert len(late) == len(due) == len(RADIOS) - 1
    assert (due["time"] - late["time"] == 100_000_000).all()


def test_a_packet_that_is_held_is_sent_once(library: Library) -> None:
    with Channel(library, TOWN) as channel:
        first = channel.step(0.0, 0.01, [packet(1, RADIOS[0], time=0)])
        held = channel.step(0.01, 0.01)
        more = channel.step(0.02, 0.01, [packet(1, RADIOS[0]), packet(2, RADIOS[0])])
    assert len(first) == len(RADIOS) - 1
    assert len(held) == 0
    assert set(more["packet"].tolist()) == {2}


def test_a_bystander_changes_nobody_elses_reception(library: Library) -> None:
    bystander = Vehicle(id=1, position=(0.0, 900.0, 0.0))
    crowd = Scene(
        vehicles=sorted([*TOWN.vehicles, bystander], key=lambda v: v.id), buildings=TOWN.buildings
    )
    with Channel(library, crowd, **WEAK) as channel:
        records, _ = run(channel, WHOLE, TRAFFIC)
    assert records[records["receiver"] != 1].tobytes() == _all(library, WHOLE)
    assert (records["receiver"] == 1).any()


def test_another_packet_changes_no_other_packets_reception(library: Library) -> None:
    half = [record for record in TRAFFIC if record["id"] % 2]
    alone = np.frombuffer(_all(library, WHOLE, half), RECEPTION)
    together = np.frombuffer(_all(library, WHOLE), RECEPTION)
    assert together[together["packet"] % 2 == 1].tobytes() == alone.tobytes()


def test_the_numbers_of_vehicles_do_not_change_powers(library: Library) -> None:
    backwards = {v.id: 1000 - v.id for v in TOWN.vehicles}
    renamed = [
        Vehicle(id=backwards[v.id], position=v.position, heading=v.heading, size=v.size,
                equipped=v.equipped)
        for v in reversed(TOWN.vehicles)
    ]  # fmt: skip
    powers = []
    for scene, name in [
        (TOWN, {v.id: v.id for v in TOWN.vehicles}),
        (Scene(vehicles=renamed, buildings=TOWN.buildings), backwards),
    ]:
        with Channel(library, scene) as channel:
            records = channel.step(0.0, 0.1, [packet(k, name[v]) for k, v in enumerate(RADIOS)])
        back = {new: old for old, new in name.items()}
        powers.append(
            {(r["packet"], back[int(r["receiver"])]): (r["power_dbm"], r["link"]) for r in records}
        )
    assert powers[0] == powers[1]


def test_a_change_of_the_scene_is_noticed(library: Library) -> None:
    moved = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(200.0, 0.0, 0.0))])
    with Channel(
        library, Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(100.0, 0.0, 0.0))])
    ) as channel:
        (near,) = channel.step(0.0, 0.1, [packet(1, 0)])
        channel.change(moved)
        (far,) = channel.step(0.1, 0.1, [packet(2, 0)])
        channel.change(
            Scene(vehicles=moved.vehicles, buildings=[Building(ring=rectangle(99, 0, 2, 9))])
        )
        (behind,) = channel.step(0.2, 0.1, [packet(3, 0)])
    assert near["power_dbm"] - far["power_dbm"] == pytest.approx(6.02, abs=0.01)
    assert far["power_dbm"] - behind["power_dbm"] == pytest.approx(18.8, abs=0.01)


@pytest.mark.parametrize("cut", [0.0004, 0.01, 0.0353, 0.042])
def test_a_restored_state_continues_bit_for_bit(library: Library, cut: float) -> None:
    rest = [cut, 0.07, 0.08]
    with Channel(library, TOWN, **WEAK) as channel:
        channel.step(0.0, cut, TRAFFIC)  # most packets are still waiting
        state = channel.save()
        expected = run(channel, rest, [])[1]
        assert len(expected[0]) > 5_000
        for _ in range(2):
            channel.restore(state)
            assert run(channel, rest, [])[1] == expected


def test_a_state_goes_to_a_fresh_instance_with_other_parameters(library: Library) -> None:
    with Channel(library, TOWN, **WEAK) as channel:
        channel.step(0.0, 0.0353, TRAFFIC)
        state = channel.save()
        expected = run(channel, [0.0353, 0.08], [])[1]
    with Channel(library, Scene(), seed=99, **NO_OBSTACLES) as other:
        other.restore(state)
        assert run(other, [0.0353, 0.08], [])[1] == expected


def test_bytes_that_are_no_state_are_refused(library: Library) -> None:
    with Channel(library, TOWN, **WEAK) as channel:
        channel.step(0.0, 0.0353, TRAFFIC)
        state = channel.save()
        at = state.index(b"CHNL")
    for damaged in (
        state[:at] + b"CHNX" + state[at + 4 :],
        state[: at + 16] + b"\xff" * 8 + state[at + 24 :],  # the number of waiting frames
        state[: at + 40 + 16] + b"\x07" + state[at + 40 + 17 :],  # the hop of the first one
    ):
        with Channel(library, TOWN) as channel, pytest.raises(Refused, match="state"):
            channel.restore(damaged)
