"""Answers with what was demanded: the part of a scan that lies in the ego's blind zones."""

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from fmus.facilities import Facilities
from fmus.facilities.answers import ANSWER_HEADER
from fmus.messages.apm import join
from fmus.messages.records import APM, BSM, NO_VEHICLE, OBJECT, REQUEST, SENSOR_DATA, frame, unframe
from orchestrator.signal import Signal
from orchestrator.testing import check_component
from tests.fmus.facilities.world import EGO, RELAY, SHARER, H, Run, apm_of, delivered, objects_of

SIZE = 60_000
EVERYTHING = (0.0, 0.0, 500.0)
Zone = tuple[float, float, float]


def zones(*rows: Zone) -> dict[str, Signal]:
    """The inputs `blind_zone.*` with (x, y, range) and unused entries, as in perception."""
    table = np.zeros((32, 3))
    table[: len(rows)] = np.reshape(rows, (-1, 3))
    return {"blind_zone__center": table[:, :2].copy(), "blind_zone__range": table[:, 2].copy()}


def scan(number: int, boxes: Sequence[tuple[float, float]] = ((10.0, 10.0), (-30.0, -30.0))) -> Any:
    """One scan of the sharer: a point in each cell, objects of 4 x 2 m at `boxes`."""
    cells = np.ones((20, 20), np.uint32)
    rows = np.zeros(len(boxes), OBJECT)
    rows["sensor"], rows["time"], rows["instance"] = SHARER, number, np.arange(len(boxes))
    rows["size"] = 4.0, 2.0
    rows["position"] = np.reshape(boxes, (-1, 2)) + rows["size"] / 2
    messages = [apm_of(EGO, number), apm_of(SHARER, number, cells)]
    return {"apms": join(messages), "objects": frame("OBJS", rows)}


class Exchange:
    """Ego and sharer, who hear all of each other unless told otherwise."""

    def __init__(self, answer: str = "demanded", **parameters: Any) -> None:
        chosen = {"answer": answer, "sensor_data_size": SIZE, "processing_time": 0.0}
        self.run = Run(Facilities(Facilities.Parameters(**chosen | parameters)))  # type: ignore[arg-type]
        self.scans = 0
        self.held: dict[str, Signal] = {}

    def step(self, **inputs: Signal) -> Any:
        """Perception holds its outputs from scan to scan."""
        self.held |= {name: inputs.pop(name) for name in ("apms", "objects") if name in inputs}
        return self.run.step(**self.held, **inputs)

    def request(self, *asked: Zone, is_lost: bool = False) -> Any:
        """The ego asks once; the packets of the request."""
        period = [self.step(match__trigger=np.array(True), **zones(*asked)) for _ in range(10)]
        packets = np.concatenate(period)
        request = packets[packets["kind"] == REQUEST]
        if not is_lost:
            self.step(receptions=delivered(request, SHARER))
        return request

    def answer(self, **inputs: Signal) -> tuple[int, list[int]]:
        """The sharer scans: bytes of its answer, and objects that the ego then knows of."""
        self.scans += 1
        packets = self.step(**{**scan(self.scans), **inputs})
        data = packets[packets["kind"] == SENSOR_DATA]
        self.step(receptions=delivered(data, EGO))
        known = unframe("OBJS", self.run.output("received.objects"), OBJECT)
        return int(data["size"].sum()), known["instance"].tolist()


def ready(answer: str = "demanded", **parameters: Any) -> Exchange:
    """After a first scan of both."""
    exchange = Exchange(answer, **parameters)
    exchange.step(**scan(0))
    return exchange


def asked(*rows: Zone) -> tuple[int, list[int]]:
    exchange = ready()
    exchange.request(*rows)
    return exchange.answer()


def test_zones_that_cover_everything_bring_what_all_brings_and_a_header() -> None:
    whole = ready("all")
    whole.request(EVERYTHING)
    size, known = whole.answer()
    assert (size, known) == (SIZE, [0, 1])
    assert asked(EVERYTHING) == (size + ANSWER_HEADER, known)


def test_without_zones_the_answer_is_a_header() -> None:
    assert asked() == (ANSWER_HEADER, [])


def test_zones_where_the_sharer_sees_nothing_bring_a_header() -> None:
    assert asked((300.0, 300.0, 10.0)) == (ANSWER_HEADER, [])


def test_the_size_is_that_of_the_points_in_the_zone() -> None:
    """A square of 20 m in a matrix of 100 m, evenly filled: 4 percent."""
    assert asked((12.0, 12.0, 10.0)) == (SIZE // 25 + ANSWER_HEADER, [0])


def test_overlapping_zones_are_paid_once() -> None:
    assert asked((12.0, 12.0, 10.0), (12.0, 12.0, 10.0)) == asked((12.0, 12.0, 10.0))


def test_disjoint_zones_add_up() -> None:
    first, second = (12.0, 12.0, 10.0), (-30.0, -30.0, 5.0)
    sizes = [asked(*rows)[0] - ANSWER_HEADER for rows in ((first,), (second,), (first, second))]
    assert sizes[0] + sizes[1] == sizes[2]
    assert asked(first, second)[1] == [0, 1]


def test_the_zones_lie_along_the_heading_of_the_ego_vehicle() -> None:
    """An object over a corner of the turned square, which the other does not reach."""
    exchange = ready()
    corner = {"objects": scan(1, [(13.0, -1.0)])["objects"]}
    exchange.request((0.0, 0.0, 10.0))
    assert exchange.answer(**corner)[1] == []
    turned = [apm_of(EGO, 5, heading=np.pi / 4), apm_of(SHARER, 5, np.ones((20, 20), np.uint32))]
    exchange.step(apms=join(turned))
    exchange.request((0.0, 0.0, 10.0))
    assert exchange.answer(**corner)[1] == [0]


@pytest.mark.parametrize("count", [0, 1, 7, 32])
def test_a_request_has_twelve_bytes_for_each_zone(count: int) -> None:
    rows = [(float(k), 0.0, 1.0) for k in range(count)]
    assert ready().request(*rows)["size"].sum() == 100 + 12 * count
    assert ready("all").request(*rows)["size"].sum() == 100


def test_the_sharer_knows_the_zones_in_single_precision() -> None:
    """The box ends 1e-9 m before the zone, which single precision does not tell from touching."""
    exchange = ready()
    exchange.request((14.0 + 10.0 + 1e-9, 11.0, 10.0))
    assert exchange.answer()[1] == [0]


def test_the_newest_zones_hold_also_when_they_arrive_first() -> None:
    exchange = ready()
    old = exchange.request((12.0, 12.0, 10.0), is_lost=True)
    new = exchange.request((-30.0, -30.0, 5.0), is_lost=True)
    assert new["time"][0] > old["time"][0]
    for request in (new, old):
        exchange.step(receptions=delivered(request, SHARER))
    assert exchange.answer() == (SIZE // 100 + ANSWER_HEADER, [1])


def test_a_lost_request_leaves_the_old_zones() -> None:
    exchange = ready()
    exchange.request((12.0, 12.0, 10.0))
    exchange.request(EVERYTHING, is_lost=True)
    assert exchange.answer() == (SIZE // 25 + ANSWER_HEADER, [0])
    exchange.request(EVERYTHING)
    assert exchange.answer() == (SIZE + ANSWER_HEADER, [0, 1])


def test_an_empty_answer_tells_that_what_was_there_is_gone() -> None:
    exchange = ready()
    exchange.request((12.0, 12.0, 10.0))
    assert exchange.answer()[1] == [0]
    assert exchange.answer(objects=scan(9, [])["objects"]) == (SIZE // 25 + ANSWER_HEADER, [])


def test_a_scan_without_objects_is_answered_too() -> None:
    """Twice nothing is twice an answer: the ego learns that the zone is still free."""
    exchange = ready()
    exchange.request((12.0, 12.0, 10.0))
    nothing = {"objects": frame("OBJS", np.empty(0, OBJECT))}
    sizes = [exchange.answer(**nothing)[0] for _ in range(3)]
    assert sizes == [SIZE // 25 + ANSWER_HEADER] * 3


def test_an_object_outside_the_zones_never_arrives() -> None:
    """It drives by; the ego knows of it exactly while its box reaches into the zone."""
    exchange = ready()
    exchange.request((0.0, 0.0, 10.0))
    for x in np.arange(-20.0, 20.0, 1.5):
        number = exchange.scans + 1
        _, known = exchange.answer(objects=scan(number, [(float(x), 1.0)])["objects"])
        assert known == ([0] if -14.0 <= x <= 10.0 else [])  # the box has a length of 4 m


def test_a_sharer_without_a_matrix_has_nothing_to_answer_with() -> None:
    exchange = ready()
    exchange.request(EVERYTHING)
    assert exchange.answer(apms=join([apm_of(EGO, 1)]))[0] == ANSWER_HEADER


def test_an_ego_without_a_scan_asks_for_nothing() -> None:
    exchange = Exchange()
    assert exchange.request(EVERYTHING)["size"].sum() == 100


def test_zones_that_are_not_connected_are_an_error_when_they_are_needed() -> None:
    exchange = ready()
    exchange.step()
    with pytest.raises(ValueError, match=r"connect .*perception\.blind_zone"):
        exchange.step(match__trigger=np.array(True))


def test_the_same_seed_gives_the_same_bytes() -> None:
    def bytes_sent() -> bytes:
        exchange = ready(processing_time=0.01)
        steps = []
        for k in range(3):
            exchange.request((12.0 + k, 12.0, 10.0))
            exchange.answer()
            steps.append(exchange.run.output("packets"))
        return b"".join(steps)

    assert bytes_sent() == bytes_sent()


def fingerprint(**inputs: Signal) -> str:
    """Of all packets but BSMs and all that was received, in a run that answers with all.

    Ids are left out: like the phases of BSMs, they depend on NumPy's random numbers.
    """
    run = Run(Facilities(Facilities.Parameters(processing_time=0.0)))
    digest, packets = hashlib.sha256(), run.step(**inputs)
    for k in range(100):
        requests = packets[packets["kind"] == REQUEST]
        for_ego = packets[np.isin(packets["destination"], [EGO, NO_VEHICLE])]
        heard = delivered(requests, SHARER) if len(requests) else delivered(for_ego, EGO)
        packets = run.step(
            apms=join([apm_of(EGO, k // 10), apm_of(SHARER, k // 10)]),
            objects=objects_of(SHARER, k // 10),
            match__trigger=np.array(20 <= k < 60),
            relay=np.array(RELAY if k > 40 else NO_VEHICLE),
            receptions=heard,
            **inputs,
        )
        shared = packets[packets["kind"] != BSM].copy()
        shared["id"] = 0
        digest.update(shared.tobytes())
        digest.update(run.output("received.apms") + run.output("received.objects"))
    assert {APM, REQUEST, SENSOR_DATA} >= set(shared["kind"])
    return digest.hexdigest()


def test_by_default_all_is_sent_as_before_there_was_a_choice() -> None:
    """The fingerprint was taken before `answer` and `blind_zone` existed.

    It has changed once since, with the bytes of `OBJECT` records when their boxes were turned.
    """
    before = "9e72f68dfbf758165a4735c70a1ad334a91853e7c7997107895826efe4e6f4d0"
    assert fingerprint() == before
    assert fingerprint(**zones(EVERYTHING)) == before


def test_contract() -> None:
    component = Facilities(Facilities.Parameters(answer="demanded"))
    check_component(component, steps=30, h=H, seed=1)
