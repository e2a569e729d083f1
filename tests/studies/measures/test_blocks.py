"""A long run is read in blocks, and says what it would say in one."""

import gc
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import LINKS, RECEPTION, frame
from orchestrator.measure import Answer, Measure, measure_type
from orchestrator.recording.reader import Recording
from studies.measures import hidden, radio
from studies.measures.delivery import unique_packets
from studies.measures.links import UNKNOWN, Links, link
from studies.measures.radio import Batch, Received, received
from tests.studies.measures.test_whole_runs import spelt
from tests.studies.measures.world import Body, packet, reception, record, transmission

OF_RECEPTIONS = ("aoi", "awareness", "delivery", "hidden", "pir", "prr")


def _recorded(folder: Path) -> None:
    """Broadcasts, and data that come twice, over a relay as well: in two blocks, or in one."""
    rng = np.random.default_rng(7)
    bodies = [
        Body(id=k, start=tuple(rng.uniform(-80, 80, 2)), velocity=tuple(rng.uniform(-9, 9, 2)))
        for k in range(9)
    ]
    packets, receptions, sent = [], [], []
    for k in range(240):
        source, time = int(rng.integers(9)), 0.012 * k + 0.001
        is_data = k % 4 == 0
        to = (source + 1) % 9
        more = {"destination": to, "kind": 2, "size": 900} if is_data else {}
        packets.append(packet(k, source, time, **more))
        sent.append(transmission(k, source, time))
        for hop, late in enumerate((0.0004, 0.0404)[: 1 + is_data]):
            receptions += [
                reception(
                    k,
                    (source, other),
                    time + late,
                    str(rng.choice(list("RRN"))),
                    link=rng.choice(LINKS),
                    hop=hop,
                    kind=2 * is_data,
                )
                for other in range(9)
                if other != source
            ]
    record(folder, bodies, 3.2, packets=packets, receptions=receptions, transmissions=sent)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    _recorded(folder)
    return folder


def _asked(name: str, run: Path) -> Answer:
    measure: Measure = measure_type(name)()
    found = measure.compute(Recording(run))
    assert isinstance(found, Answer)
    return found


@pytest.mark.parametrize("name", OF_RECEPTIONS)
@pytest.mark.parametrize("size", [1, 10, 333])
def test_numbers_and_tables_are_equal(
    name: str, size: int, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = _asked(name, run)
    monkeypatch.setattr(radio, "_BATCH", size)
    monkeypatch.setattr(radio, "_KEPT", 0)
    monkeypatch.setattr(hidden, "_BLOCK", size)
    assert spelt(_asked(name, run)) == spelt(whole)
    assert any(whole.numbers.values())


@pytest.mark.parametrize("name", OF_RECEPTIONS)
def test_what_a_recording_held_goes_with_it(name: str, run: Path) -> None:
    """A campaign's worker asks of thousands; what each leaves behind would fill the memory."""
    recording = Recording(run)
    once = measure_type(name)().compute(recording)
    assert received(recording, "channel.receptions").returning is not None
    gone = weakref.ref(recording)
    del recording, once
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize(("kept", "times"), [(10, 3), (100_000, 1)])
def test_receptions_of_a_short_run_are_read_once_for_all_measures(
    kept: int, times: int, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(radio, "_KEPT", kept)
    read, reads = radio._read, []

    def counted(recording: Recording, signal: str) -> Iterator[Batch]:
        reads.append(signal)
        yield from read(recording, signal)

    monkeypatch.setattr(radio, "_read", counted)
    recording = Recording(run)
    for _ in range(2):  # two measures
        for batch in received(recording, "channel.receptions").batches("any"):
            assert not batch.records.flags.writeable  # one must not change the other's
    assert reads == times * ["channel.receptions"]


@pytest.mark.parametrize("size", [10, 100_000])
def test_what_comes_again_in_another_block_is_delivered_once(
    size: int, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Data are received over two hops, 40 ms from each other; some come over the second only."""
    monkeypatch.setattr(radio, "_BATCH", size)
    recording = Recording(run)
    sent = unique_packets(recording, "facilities.packets")
    to = dict(zip(sent["id"].tolist(), sent["destination"].tolist(), strict=True))
    rows = [
        row
        for batch in received(recording, "channel.receptions").batches("sensor_data")
        for row in batch.records
        if row["receiver"] == to[int(row["packet"])]
    ]
    arrived = {int(row["packet"]) for row in rows}
    numbers = _asked("delivery", run).numbers
    assert numbers["sensor_data_packets"] == 60
    assert 0 < len(arrived) < 60
    assert len(arrived) < len(rows)
    assert numbers["sensor_data_deliveries"] == len(arrived)
    late = len(arrived - {int(row["packet"]) for row in rows if row["hop"] == 0})
    assert late
    mean = (0.4 * (len(arrived) - late) + 40.4 * late) / len(arrived)
    assert numbers["sensor_data_latency_mean_ms"] == pytest.approx(mean)


class _Series:
    """Samples of receptions: the times at which some of them were told [ms], and theirs."""

    def __init__(self, told: dict[int, list[tuple[int, int]]]) -> None:
        self.times = np.array([*told]) * 1_000_000
        self._samples = [self._frame(rows) for rows in told.values()]

    def __getitem__(self, k: int) -> bytes:
        return self._samples[k]

    @staticmethod
    def _frame(rows: list[tuple[int, int]]) -> bytes:
        table = np.zeros(len(rows), RECEPTION)
        for row, (number, time) in zip(table, rows, strict=True):
            row["packet"], row["time"] = number, time * 1_000_000
        return frame("RCPT", table)


def _received(told: dict[int, list[tuple[int, int]]]) -> Received:
    recording: Any = {"channel.receptions": _Series(told)}
    signal = "channel.receptions"
    return Received(recording, signal, radio._looked_through(recording, signal))


@pytest.mark.parametrize("kept", [0, 100])
def test_batches_ascend_even_if_what_was_told_does_not(
    kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A channel of somebody else may tell of a reception later than of one after it."""
    monkeypatch.setattr(radio, "_BATCH", 2)
    monkeypatch.setattr(radio, "_KEPT", kept)

    def of(found: Received) -> list[list[int]]:
        return [batch.records["time"].tolist() for batch in found.batches("any")]

    in_turn = _received({10: [(1, 4), (2, 9)], 20: [(1, 11), (3, 15)]})
    assert of(in_turn) == [[4_000_000, 9_000_000], [11_000_000, 15_000_000], []]
    assert in_turn.returning.tolist() == [1]
    at_once = _received({10: [(1, 4), (2, 9)], 20: [(3, 9), (4, 15)]})
    assert of(at_once) == [[4_000_000, 9_000_000], [9_000_000, 15_000_000], []]
    late = _received({10: [(1, 4), (2, 9)], 20: [(3, 15), (4, 8)]})
    assert of(late) == [[4_000_000, 8_000_000, 9_000_000, 15_000_000]]
    (batch,) = late.batches("any")
    assert batch.times.tolist() == [10_000_000, 20_000_000, 10_000_000, 20_000_000]


def test_a_link_keeps_its_row() -> None:
    links = Links()
    assert links.rows(link(np.array([1]), np.array([2]))).tolist() == [UNKNOWN]
    assert links.meet(link(np.array([5, 3, 5]), np.array([1, 1, 1]))).tolist() == [1, 0, 1]
    assert links.meet(link(np.array([4, 5]), np.array([0, 1]))).tolist() == [2, 1]
    wanted = link(np.array([3, 1, 4]), np.array([1, 3, 0]))  # from 1 to 3 is another way
    assert links.rows(wanted).tolist() == [0, UNKNOWN, 2]
    assert len(links) == 3
