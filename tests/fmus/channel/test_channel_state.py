"""A restored state continues bit for bit, wherever and whenever it was saved."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from fmus.messages.records import FATES, OUTCOMES
from orchestrator.signal import Array
from tests.fmus.driver import Library, Refused
from tests.fmus.scene import Scene, Vehicle

from .harness import MS, NO_OBSTACLES, Channel
from .town import BUSY, RADIOS, TOWN, WEAK, busy_traffic, light_traffic

END = 60 * MS
TRAFFIC = busy_traffic()
ROOT = Path(__file__).parents[3]


def _advance(channel: Channel, begin: int, end: int, records: Sequence[Array]) -> tuple[bytes, ...]:
    """All outputs of one step [ns]."""
    channel.step(begin / 1e9, (end - begin) / 1e9, records)
    return channel.receptions(), channel.transmissions().tobytes(), _ratios(channel)


def _ratios(channel: Channel) -> bytes:
    return channel.get("busy_ratio", len(TOWN.vehicles)).tobytes()


def test_the_traffic_has_everything(library: Library) -> None:
    with Channel(library, TOWN, **BUSY) as channel:
        received = channel.step(0.0, END / 1e9, TRAFFIC)
        sent = channel.transmissions()
        ratios = channel.get("busy_ratio", len(TOWN.vehicles))
    assert {OUTCOMES[k] for k in received["outcome"]} == set(OUTCOMES)
    assert {FATES[k] for k in sent["fate"]} == set(FATES) - {"gone"}
    assert set(received["hop"].tolist()) == {0, 1, 2}
    assert set(sent["access_category"].tolist()) == {0, 1, 2, 3}
    assert ratios.max() > 0


@given(cut=st.integers(1, 50 * MS))
@settings(max_examples=40, deadline=None)
def test_a_restored_state_continues_bit_for_bit(library: Library, cut: int) -> None:
    with Channel(library, TOWN, **BUSY) as channel:
        _advance(channel, 0, cut, TRAFFIC)
        state = channel.save()
        expected = _advance(channel, cut, END, [])
        last = channel.save()
        channel.restore(state)
        assert _advance(channel, cut, END, []) == expected
        assert channel.save() == last
    with Channel(library, Scene(), seed=99, **NO_OBSTACLES) as other:
        other.restore(state)
        assert other.save() == state
        assert _advance(other, cut, END, []) == expected
        assert other.save() == last


@given(cut=st.integers(1, 50 * MS), gone=st.sets(st.sampled_from(RADIOS), min_size=1, max_size=8))
@settings(max_examples=25, deadline=None)
def test_so_does_one_from_after_vehicles_have_left_and_entered(
    library: Library, cut: int, gone: set[int]
) -> None:
    new = [Vehicle(id=1, position=(3.0, 9.0, 0.0)), Vehicle(id=1000, position=(-90.0, 9.0, 0.0))]
    vehicles = sorted([*TOWN.vehicles, *new], key=lambda v: v.id)
    changed = Scene(vehicles=[v for v in vehicles if v.id not in gone], buildings=TOWN.buildings)
    with Channel(library, TOWN, **BUSY) as channel:
        _advance(channel, 0, cut, TRAFFIC)
        channel.change(changed)
        before = channel.save()  # the inputs are new, the radios are still those of before
        first = channel.step(cut / 1e9, 1e-4, []).tobytes()
        after = channel.save()
        second = channel.step(cut / 1e9 + 1e-4, 0.01, []).tobytes()
    with Channel(library, TOWN, **BUSY) as other:
        other.restore(before)
        assert other.step(cut / 1e9, 1e-4, []).tobytes() == first
        other.restore(after)
        assert other.step(cut / 1e9 + 1e-4, 0.01, []).tobytes() == second


def test_a_state_of_a_long_run_is_no_larger_than_one_of_a_short_run(library: Library) -> None:
    """Frames that are over, and radios that nobody hears, leave nothing behind."""
    far = Scene(vehicles=[Vehicle(id=k, position=(9000.0 * k, 0.0, 0.0)) for k in range(2)])
    for scene in (far, Scene(vehicles=[Vehicle(id=0), Vehicle(id=1)])):
        sizes = []
        with Channel(library, scene) as channel:
            for k in range(300):
                records = light_traffic(4)
                for n, record in enumerate(records):
                    record["id"], record["time"] = 4 * k + n, k * 10 * MS
                    record["source"], record["route"], record["destination"] = n % 2, -1, -1
                channel.step(k * 0.01, 0.01, records)
                if k in (5, 299):
                    sizes.append(len(channel.save()))
        assert sizes[0] == sizes[1]


def test_bytes_that_are_no_state_are_refused(library: Library) -> None:
    with Channel(library, TOWN, **WEAK) as channel:
        channel.step(0.0, 0.0353, light_traffic())
        state = channel.save()
        at = state.index(b"CHNL")
    for damaged in (
        b"",
        state[:-1],
        state[:at] + b"CHNX" + state[at + 4 :],
        state[: at + 24] + b"\xff" * 8 + state[at + 32 :],  # the number of waiting frames
    ):
        with Channel(library, TOWN) as channel, pytest.raises(Refused, match="state"):
            channel.restore(damaged)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_bytes_crash(library: Library, seed: int) -> None:
    """Damaged states with a right checksum are refused or run on; in a process of its own."""
    command = [sys.executable, "-m", "tests.fmus.channel.damaged_states", str(seed), "150"]
    answer = subprocess.run(
        [*command, str(library.folder)], cwd=ROOT, capture_output=True, text=True, check=False,
        timeout=120, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert answer.returncode == 0, answer.stdout + answer.stderr
    refused, ran = (int(number) for number in answer.stdout.split())
    assert refused + ran == 150
    assert refused > 0
    assert ran > 0
