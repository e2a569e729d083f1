"""What happens does not depend on how time is cut into steps, nor on who else is there."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.messages.records import OUTCOMES, RECEPTION, TRANSMISSION, unframe
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import AIRTIME, MS, Channel, packet, run
from .town import BUSY, RADIOS, TOWN, WEAK, busy_traffic, light_traffic

pytestmark = pytest.mark.slow

TRAFFIC = light_traffic()
WHOLE = [0.0, 0.08]


def _all(library: Library, cuts: Sequence[float], records: Sequence[Array] = TRAFFIC) -> bytes:
    with Channel(library, TOWN, **WEAK) as channel:
        return run(channel, cuts, records)[0].tobytes()


def test_the_traffic_has_losses_and_relays(library: Library) -> None:
    records = np.frombuffer(_all(library, WHOLE), RECEPTION)
    outcomes = {OUTCOMES[k] for k in records["outcome"]}
    assert outcomes == set(OUTCOMES)
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
@settings(max_examples=25, deadline=None)
def test_any_cuts_give_equal_receptions(library: Library, cuts: list[int]) -> None:
    assert _all(library, [0.0, *(c * 1e-6 for c in sorted(cuts)), 0.08]) == _all(library, WHOLE)


CROWDED = busy_traffic()
END = 60 * MS


def _everything(library: Library, cuts: Sequence[int], **parameters: float) -> list[bytes]:
    """All outputs of busy traffic in steps between these times [ns], which lie within 0..END."""
    received, sent = [], []
    with Channel(library, TOWN, **{**BUSY, **parameters}) as channel:
        for begin, end in itertools.pairwise([0, *sorted(set(cuts)), END]):
            records = [r for r in CROWDED if begin <= r["time"] < end]
            received.append(channel.step(begin / 1e9, (end - begin) / 1e9, records))
            sent.append(channel.transmissions())
        ratios = channel.get("busy_ratio", len(TOWN.vehicles))
    return [np.concatenate(received).tobytes(), np.concatenate(sent).tobytes(), ratios.tobytes()]


@given(
    cuts=st.sets(st.integers(1, END - 1), max_size=30),
    switches=st.fixed_dictionaries(
        {name: st.booleans() for name in ("medium_access", "weak_receptions", "frame_capture")}
    ),
)
@settings(max_examples=30, deadline=None)
def test_any_cuts_give_equal_outputs_of_busy_traffic(
    library: Library, cuts: set[int], switches: dict[str, bool]
) -> None:
    assert _everything(library, sorted(cuts), **switches) == _everything(library, [], **switches)


@pytest.mark.parametrize("medium_access", [True, False])
@pytest.mark.parametrize("shift", [-1, 0, 1])
def test_so_do_cuts_exactly_where_something_happens(
    library: Library, shift: int, *, medium_access: bool
) -> None:
    whole = _everything(library, [], medium_access=medium_access)
    received = np.frombuffer(whole[0], RECEPTION)
    sent = np.frombuffer(whole[1], TRANSMISSION)
    times = np.concatenate([received["time"], sent["time"], sent["time"] + sent["duration"]])
    cuts = np.unique(times + shift)
    cuts = cuts[(cuts > 0) & (cuts < END)][:: 1 if len(cuts) < 600 else len(cuts) // 300]
    assert _everything(library, cuts.tolist(), medium_access=medium_access) == whole


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


def test_transmissions_come_in_order_and_in_the_step_in_which_they_begin(library: Library) -> None:
    """Where one frame ends, at a communication point, the next one of its radio begins."""
    scene = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(9.0, 0.0, 0.0))])
    records = [packet(5, 0), packet(7, 0), packet(3, 1, time=AIRTIME)]
    with Channel(library, scene, medium_access=False) as channel:
        channel.step(0.0, AIRTIME * 1e-9, [records[0], records[1]])
        first = channel.transmissions()
        channel.step(AIRTIME * 1e-9, 0.1, [records[2]])
        second = channel.transmissions()
    assert first[["time", "packet"]].tolist() == [(0, 5)]
    assert second[["time", "packet"]].tolist() == [(AIRTIME, 3), (AIRTIME, 7)]


def test_a_late_packet_goes_on_air_at_once(library: Library) -> None:
    with Channel(library, TOWN, medium_access=False) as channel:
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


def test_frames_that_do_not_overlap_do_not_change_each_others_reception(library: Library) -> None:
    records = [packet(k, RADIOS[k % len(RADIOS)], time=k * MS) for k in range(80)]
    every = {"medium_access": False, **WEAK}
    with Channel(library, TOWN, **every) as channel:
        together, _ = run(channel, WHOLE, records)
    with Channel(library, TOWN, **every) as channel:
        alone, _ = run(channel, WHOLE, [r for r in records if r["id"] % 2])
    assert together[together["packet"] % 2 == 1].tobytes() == alone.tobytes()
    assert {OUTCOMES[k] for k in alone["outcome"]} == {"R", "N", "U"}


def test_a_frame_that_nobody_can_hear_changes_no_reception(library: Library) -> None:
    far = Vehicle(id=1, position=(0.0, 50_000.0, 0.0))
    crowd = Scene(
        vehicles=sorted([*TOWN.vehicles, far], key=lambda v: v.id), buildings=TOWN.buildings
    )
    cries = [packet(1000 + k, 1, time=k * MS // 4) for k in range(200)]
    records = sorted([*TRAFFIC, *cries], key=lambda r: (int(r["time"]), int(r["id"])))
    with Channel(library, crowd, **WEAK) as channel:
        received, _ = run(channel, WHOLE, records)
    assert received.tobytes() == _all(library, WHOLE)


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
