"""The table of when the direct link is out, from a hand-made recording."""

from typing import Any

import numpy as np
import pytest

from fmus.messages.records import frame
from studies.red_light.outage import outage, table
from tests.studies.red_light.test_metrics import Run, Samples, packet, reception, recording

SECOND = 1_000_000_000


def at(time: float, row: Any) -> Any:
    row["time"] = round(time * SECOND)
    return row


def run_of(packets: list[Any], heard: list[Any]) -> Run:
    return recording() | {
        "facilities.packets": Samples([b"", b"", frame("PKTS", np.concatenate(packets))]),
        "channel.receptions": Samples([b"", b"", frame("RCPT", np.concatenate(heard))]),
    }


def test_packets_count_in_the_second_in_which_they_were_sent_and_only_if_heard_directly() -> None:
    found = outage(
        run_of(
            [at(0.1, packet(0)), at(0.9, packet(1)), at(2.1, packet(2)), at(2.2, packet(3))],
            [
                at(0.2, reception(0, 1, "R")),
                at(1.0, reception(1, 1, "N")),
                at(2.2, reception(2, 1, "R")),
                at(2.3, reception(3, 1, "R", hop=1)),  # over a relay
                at(2.3, reception(3, 7, "R")),
            ],
        )
    )
    assert found.sent.tolist() == [2, 0, 2]
    assert found.received.tolist() == [1, 0, 1]
    assert found.silence == pytest.approx((0.2, 2.2))


def test_the_last_moment_leaves_the_stopping_distance_before_the_path() -> None:
    """At 0.2 s the front is at 22 m, the path begins at 99 m; from 10 m/s it takes 7.25 m."""
    run = run_of([packet(0)], [reception(0, 1, "R")])
    position = [np.array([[0, 10.0 * k, 0], [0, 100, 0], [30, 30, 0]]) for k in range(3)]
    velocity = [np.array([[0.0, 10.0], [5.0, 0.0], [0.0, 0.0]])] * 3
    run |= {
        "traffic.vehicle.position": Samples(position),
        "traffic.vehicle.velocity": Samples(velocity),
    }
    found = outage(run)
    assert found.braked == pytest.approx(0.2)
    assert found.last_moment == pytest.approx(0.2 + (99 - 22 - 1.0 - 100 / 16) / 10)
    assert found.silence is None


def test_the_table_begins_where_something_was_sent() -> None:
    run = run_of([at(1.5, packet(0)), at(1.6, packet(1))], [at(1.7, reception(1, 1, "R"))])
    run["policy.command"] = Samples([np.zeros(3)] * 3)
    head, _, row = table([("red_light_driving-101", outage(run))]).splitlines()
    assert head == ("| run | 1 s | silence [s] | brakes [s] | full brakes until [s] | collision |")
    assert row == "| red_light_driving-101 | 1/2 | - | - | - | yes |"
