"""What the ego knows: the newest of everything, while it is fresh."""

import numpy as np
from hypothesis import given, strategies as st

from fmus.facilities.received import Received
from fmus.messages.apm import join
from fmus.messages.records import OBJECT, unframe

AGE = 100
REPORT = st.tuples(st.integers(0, 50), st.lists(st.integers(0, 5), unique=True, max_size=6))


def table(time: int, numbers: list[int]) -> np.ndarray:
    rows = np.zeros(len(numbers), OBJECT)
    rows["time"], rows["instance"] = time, numbers
    return rows


def known(received: Received, now: int) -> list[tuple[int, int]]:
    rows = unframe("OBJS", received.outputs(now)["received.objects"], OBJECT)
    return [(int(row["instance"]), int(row["time"])) for row in rows]


@given(st.lists(REPORT, max_size=8), st.integers(50, 200))
def test_of_parts_the_newest_report_of_each_object_is_known_while_fresh(
    reports: list[tuple[int, list[int]]], now: int
) -> None:
    received = Received(AGE)
    newest: dict[int, int] = {}
    for time, numbers in reports:
        received.update_objects(7, table(time, numbers))
        newest |= {n: max(time, newest.get(n, 0)) for n in numbers}
    fresh = [(n, newest[n]) for n in sorted(newest) if now - newest[n] <= AGE]
    assert known(received, now) == fresh


@given(st.lists(REPORT, min_size=1, max_size=8))
def test_of_whole_scans_the_newest_is_known(reports: list[tuple[int, list[int]]]) -> None:
    received = Received(AGE)
    newest = (-1, [0])
    for time, numbers in reports:
        received.replace_objects(7, time, table(time, numbers))
        newest = max(newest, (time, numbers), key=lambda report: report[0])
    assert known(received, 50) == [(number, newest[0]) for number in newest[1]]


def test_an_empty_scan_means_that_nothing_is_seen_any_more() -> None:
    received = Received(AGE)
    received.replace_objects(7, 10, table(10, [1, 2]))
    received.replace_objects(7, 20, table(20, []))
    assert known(received, 20) == []


def test_an_apm_is_known_up_to_its_maximum_age() -> None:
    received = Received(AGE)
    received.keep_apm(7, 10, b"seven")
    received.keep_apm(3, 20, b"three")
    assert received.outputs(10 + AGE)["received.apms"] == join([b"three", b"seven"])
    assert received.outputs(11 + AGE)["received.apms"] == join([b"three"])


def test_what_did_not_change_is_the_same_object() -> None:
    received = Received(AGE)
    received.update_objects(7, table(10, [1, 2]))
    first, second = received.outputs(20), received.outputs(30)
    assert first["received.objects"] is second["received.objects"]
    assert first["received.apms"] is second["received.apms"]
