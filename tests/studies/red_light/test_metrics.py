"""Metrics of hand-made recordings with known results."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from fmus.messages.records import (
    LINKS,
    NO_VEHICLE,
    OBJECT,
    OUTCOMES,
    PACKET,
    RECEPTION,
    SENSOR_DATA,
    frame,
    unframe,
)
from studies.method.records import from_json
from studies.red_light import RedLightReport, figure
from studies.red_light.delivery import packet_reception
from studies.red_light.identity import Roles, vehicles_of
from studies.red_light.metrics import Link, Metrics, compute
from studies.red_light.roles import BLOCKING, COLLISION, EGO, ROADSIDE, SHARING, roles_of
from studies.red_light.traces import Traces
from tests.fmus.boxes import put

TENTH = 100_000_000
ENTITIES = ("ego", "collider", "sharer", "blocking")
NOTHING_SENT = {"end_to_end": None, "direct": None, "messages": None, "sent": 0, "lost": None}
LOST_TO_NOTHING = dict.fromkeys(
    ["noise", "interference", "receiver_busy", "receiver_transmitting", "unnoticed"], 0.0
)


class Samples:
    """A recorded signal made of a list."""

    def __init__(self, values: Sequence[Any]) -> None:
        self._values = values
        self.times = np.arange(len(values)) * TENTH

    def __len__(self) -> int:
        return len(self._values)

    def __getitem__(self, index: int) -> Any:
        return self._values[index]

    def at(self, t: int) -> Any:
        return self._values[int(np.searchsorted(self.times, t, side="right")) - 1]


class Run(dict[str, Samples]):
    """Recorded signals by name; their scenario has the entities of the red light, in its order."""

    def __init__(self, signals: Mapping[str, Samples], names: Sequence[str] = ENTITIES) -> None:
        super().__init__(signals)
        self.manifest = manifest(names)

    @override
    def __or__(self, other: Mapping[str, Samples]) -> "Run":  # type: ignore[override]
        return Run({**self, **other})


def manifest(names: Sequence[str], kind: str = "sedan") -> dict[str, Any]:
    """Of a scenario with entities of these names and one type."""
    entities = {name: {"type": kind} for name in names}
    return {"scenario": {"components": {"traffic": {"parameters": {"entities": entities}}}}}


def packet(number: int) -> Any:
    row = np.zeros(1, PACKET)
    row["id"], row["source"], row["destination"], row["kind"] = number, 3, 1, SENSOR_DATA
    row["size"], row["time"] = 200, number // 2  # packets 0 and 1 are one message
    return row


def reception(number: int, receiver: int, outcome: str, hop: int = 0, addressed: int = 1) -> Any:
    row = np.zeros(1, RECEPTION)
    row["packet"], row["receiver"], row["hop"] = number, receiver, hop
    row["transmitter"], row["kind"] = 3 if hop == 0 else 7, SENSOR_DATA
    row["outcome"], row["addressed"] = OUTCOMES.index(outcome), addressed
    row["link"], row["power_dbm"] = LINKS.index("NLOSv"), -90
    return row


def seen(sensor: int, track: int, time: int) -> Any:
    """The nose of the collision vehicle, with a track number that says nothing."""
    row = np.zeros(1, OBJECT)
    row["sensor"], row["instance"], row["time"] = sensor, track, time
    put(row, (-2.0, 19.0), (-1.5, 21.0))
    return row


def recording() -> Run:
    """Three samples; ego 1, collision vehicle 2, sharing node 3, relay 7.

    The ego drives north at 10 m/s, the collision vehicle stands 20 m ahead of its start.
    """
    position = [np.array([[0, 10.0 * k, 0], [0, 20, 0], [30, 30, 0]]) for k in range(3)]
    none = np.empty(0, OBJECT)
    heard = [
        np.empty(0, RECEPTION),
        np.concatenate(
            [reception(0, 1, "R"), reception(1, 1, "N", addressed=0), reception(1, 7, "R")]
        ),
        np.concatenate([reception(1, 1, "R", hop=1), reception(2, 1, "N")]),
    ]
    columns: dict[str, Sequence[Any]] = {
        "traffic.vehicle.id": [np.array([1, 2, 3])] * 3,
        "traffic.vehicle.position": position,
        "traffic.vehicle.heading": [np.array([np.pi / 2, 0, 0])] * 3,
        "traffic.vehicle.velocity": [np.zeros((3, 2))] * 3,
        "traffic.vehicle.size": [np.array([[4.0, 2, 1.5]] * 3)] * 3,
        "traffic.vehicle.role": [np.array([EGO, COLLISION, SHARING])] * 3,
        "traffic.building.vertex": [np.array([[40.0, 0], [50, 0], [50, 10]])] * 3,
        "traffic.building.index": [np.zeros(3, np.int32)] * 3,
        "traffic.ego.collision": [np.array(False), np.array(False), np.array(True)],
        "traffic.ego.collision_time": [np.array(-1.0), np.array(-1.0), np.array(0.17)],
        "traffic.ego.collision_partner": [np.array(-1), np.array(-1), np.array(2)],
        "traffic.ego.completion_time": [np.array(-1.0)] * 3,
        "traffic.ego.speed": [np.array(10.0), np.array(10.0), np.array(9.0)],
        "relay.relay": [np.array(-1), np.array(7), np.array(7)],
        "relay.switches": [np.array(0), np.array(1), np.array(1)],
        "facilities.packets": [
            frame("PKTS", np.concatenate([packet(0), packet(1)])),
            frame("PKTS", packet(2)),
            b"",
        ],
        "channel.receptions": [frame("RCPT", rows) for rows in heard],
        "perception.objects": [
            frame("OBJS", none),
            frame("OBJS", seen(3, 40, TENTH)),
            frame("OBJS", seen(1, 3, 2 * TENTH)),
        ],
        "perception.apms": [b""] * 3,
        "perception.match.trigger": [np.array(True)] * 3,
        "perception.match.sharer": [np.array([3])] * 3,
        "perception.blind_zone.center": [np.zeros((2, 2))] * 3,
        "perception.blind_zone.range": [np.array([5.0, 0.0])] * 3,
        "facilities.received.objects": [b"", b"", frame("OBJS", seen(3, 40, TENTH))],
        "policy.command": [np.zeros(3), np.array([0.0, 0.05, 0.0]), np.array([0.0, 0.4, 0.0])],
        "policy.hazard.instance": [np.array(-1), np.array(-1), np.array(40)],
        "policy.hazard.sensor": [np.array(-1), np.array(-1), np.array(3)],
        "policy.hazard.age": [np.array(0.0), np.array(0.0), np.array(0.15)],
    }
    return Run({name: Samples(values) for name, values in columns.items()})


def heard_in(run: dict[str, Samples]) -> list[bytes]:
    series = run["channel.receptions"]
    return [series[k] for k in range(len(series))]


def test_metrics_of_a_known_run() -> None:
    found = compute(Traces(recording()))
    assert found.collision
    assert found.collision_time == 0.17  # the exact one, not that of the sample
    assert found.collision_partner == "collision vehicle"
    assert found.completion_time is None
    assert found.success is False
    assert found.min_gap_m == 0.0
    assert asdict(found.prr) == {
        "end_to_end": pytest.approx(2 / 3),
        "direct": pytest.approx(1 / 3),
        "messages": pytest.approx(1 / 2),
        "sent": 3,
        "lost": LOST_TO_NOTHING | {"noise": pytest.approx(1 / 3)},
    }
    assert asdict(found.session) == {"begin": 0.0, "scans": 2, "served": pytest.approx(1 / 2)}
    assert found.relay_switches == 1
    assert found.relays == (7,)
    told = "relays         chosen: 7; 1 switches (changes while fusion goes on)"
    assert told in RedLightReport().summary(asdict(found), {}).splitlines()
    assert found.bytes_sent == 600
    assert asdict(found.hidden_vehicle) == {
        "id": 2,
        "first_seen": pytest.approx(0.1),
        "first_seen_by": "sharing node",
        "seen_by_ego": pytest.approx(0.2),
        "received_by_ego": pytest.approx(0.2),
    }
    assert asdict(found.braking) == {
        "pedal": pytest.approx(0.2),
        "time": pytest.approx(0.2),
        "object": 2,
        "seen_by": 3,
        "data_age": pytest.approx(0.15),
    }


CLOSEST = "no collision, smallest gap to the hidden vehicle"


def outcome(*, partner: int | None, completed: float | None) -> dict[str, Samples]:
    """What the traffic says about a collision at 0.17 s with `partner`, and about the passage."""
    collided = partner is not None
    return {
        "traffic.ego.collision": Samples([np.array(False), np.array(False), np.array(collided)]),
        "traffic.ego.collision_time": Samples([np.array(0.17 if collided else -1.0)] * 3),
        "traffic.ego.collision_partner": Samples(
            [np.array(-1 if partner is None else partner)] * 3
        ),
        "traffic.ego.completion_time": Samples([np.array(completed or -1.0)] * 3),
    }


@pytest.mark.parametrize(
    ("run", "expected", "told"),
    [
        (
            outcome(partner=None, completed=0.19),
            (None, None, 0.19, True),
            f"{CLOSEST} 0.00 m at 0.20 s; completed at 0.19 s",
        ),
        (
            outcome(partner=None, completed=None),
            (None, None, None, False),
            f"{CLOSEST} 0.00 m at 0.20 s; not completed",
        ),
        (
            outcome(partner=3, completed=None),
            (0.17, "sharing node", None, False),
            "COLLISION at 0.17 s with the sharing node; not completed",
        ),
        (
            outcome(partner=2, completed=0.15),
            (0.17, "collision vehicle", 0.15, False),
            "COLLISION at 0.17 s with the collision vehicle; completed at 0.15 s",
        ),
    ],
)
def test_success_is_to_complete_without_a_collision(
    run: dict[str, Samples], expected: tuple[object, ...], told: str
) -> None:
    found = compute(Traces(recording() | run))
    names = ("collision_time", "collision_partner", "completion_time", "success")
    assert tuple(getattr(found, name) for name in names) == expected
    assert found.collision == (expected[0] is not None)
    assert RedLightReport().summary(asdict(found), {}).splitlines()[0] == told


def test_the_gap_to_anybody_is_the_smallest_recorded_one_under_a_name_of_its_own() -> None:
    """A truck is passed at 1.32 m, and the hidden vehicle comes no closer than 0 m to the ego."""
    run = recording() | outcome(partner=None, completed=None)
    run["traffic.ego.gap"] = Samples([np.array(each) for each in (3.0, 1.32, 2.0)])
    run["traffic.ego.nearest"] = Samples([np.array(each) for each in (2, 6, 2)])
    found = compute(Traces(run))
    assert (found.ego_gap_m, found.ego_gap_time, found.ego_gap_vehicle) == (1.32, 0.1, 6)
    assert found.min_gap_m == 0.0
    assert RedLightReport().summary(asdict(found), {}).splitlines()[0] == (
        f"{CLOSEST} 0.00 m at 0.20 s, to any 1.32 m at 0.10 s (vehicle 6); not completed"
    )


def test_there_is_no_gap_to_anybody_where_nobody_is_or_nobody_recorded_it() -> None:
    run = recording() | outcome(partner=None, completed=None)
    assert compute(Traces(run)).ego_gap_m is None
    run["traffic.ego.gap"] = Samples([np.array(1000.0)] * 3)
    run["traffic.ego.nearest"] = Samples([np.array(-1)] * 3)
    assert compute(Traces(run)).ego_gap_m is None


@pytest.mark.parametrize(("role", "told"), [(0, "a vehicle of the background"),
                                            (4, "a blocking vehicle")])  # fmt: skip
def test_the_partner_is_named_by_its_role_also_if_it_has_left_since(role: int, told: str) -> None:
    """Vehicle 9 is there in the first sample only; the ego hit it then."""
    run = recording() | outcome(partner=9, completed=None)
    run["traffic.vehicle.id"] = Samples([np.array([1, 2, 9]), *[np.array([1, 2, 3])] * 2])
    roles = np.array([EGO, COLLISION, SHARING])
    run["traffic.vehicle.role"] = Samples([np.array([EGO, COLLISION, role]), roles, roles])
    found = compute(Traces(run))
    assert f"with {told};" in RedLightReport().summary(asdict(found), {})


def test_who_is_who_is_told_by_the_names_of_entities_not_by_their_order() -> None:
    """The same run with the entities declared in another order, and with one more."""
    names = ("rsu", "sharer", "witness", "collider", "ego")
    numbers = np.array([1 + names.index(name) for name in ("ego", "collider", "sharer")])
    roles = {"traffic.vehicle.role": Samples([numbers] * 3)}
    assert compute(Traces(Run({**recording(), **roles}, names))) == compute(Traces(recording()))


def test_other_entities_are_background_and_roadside_units_are_told_by_their_type() -> None:
    found = roles_of(manifest(["blocking", "witness", "collider"]))
    assert found.tolist() == [0, BLOCKING, 0, COLLISION]
    assert roles_of(manifest(["rsu", "mast"], "roadside_unit")).tolist() == [0, ROADSIDE, ROADSIDE]
    absent = {"scenario": {"components": {"traffic": {"parameters": {"entities": {"ego": None}}}}}}
    assert roles_of(absent).tolist() == [0, EGO]


def test_roles_of_entities_that_nobody_declared_are_refused() -> None:
    with pytest.raises(ValueError, match=r"`traffic.vehicle.role` has 3, but the scenario of the"):
        compute(Traces(Run(recording(), ["ego", "collider"])))


def test_an_object_is_the_vehicle_in_whose_body_it_lies() -> None:
    beside = seen(3, 2, TENTH)
    put(beside, (-4.0, 24.0), (-3.0, 25.0))
    touching = seen(3, 2, TENTH)
    put(touching, (-2.0, 21.2), (2.0, 21.6))
    objects = np.concatenate([seen(3, 9, TENTH), beside, touching])
    assert vehicles_of(objects, Traces(recording())).tolist() == [2, -1, 2]


def test_packets_that_may_still_be_on_their_way_do_not_count() -> None:
    late = packet(2)
    late["time"] = 2 * TENTH - 1
    run = recording() | {
        "facilities.packets": Samples(
            [frame("PKTS", np.concatenate([packet(0), packet(1)])), frame("PKTS", late), b""]
        )
    }
    assert asdict(compute(Traces(run)).prr) == {
        "end_to_end": 1.0,
        "direct": 0.5,
        "messages": 1.0,
        "sent": 2,
        "lost": LOST_TO_NOTHING,
    }


def broadcasts(source: int) -> Samples:
    """The packets of `recording`, sent to everybody by `source`."""
    rows = np.concatenate([packet(number) for number in range(3)])
    rows["source"], rows["destination"] = source, NO_VEHICLE
    return Samples([frame("PKTS", rows), b"", b""])


def test_broadcasts_of_the_sharing_node_are_for_the_ego_too() -> None:
    """Nothing relays them, so what reached the ego reached it directly."""
    heard = [reception(0, 1, "R"), reception(1, 1, "N"), reception(1, 7, "R"), reception(2, 1, "R")]
    run = recording() | {
        "facilities.packets": broadcasts(3),
        "channel.receptions": Samples([b"", frame("RCPT", np.concatenate(heard)), b""]),
    }
    assert asdict(compute(Traces(run)).prr) == {
        "end_to_end": pytest.approx(2 / 3),
        "direct": pytest.approx(2 / 3),
        "messages": pytest.approx(1 / 2),
        "sent": 3,
        "lost": LOST_TO_NOTHING | {"noise": pytest.approx(1 / 3)},
    }


@pytest.mark.parametrize("source", [1, 2, 7])
def test_broadcasts_of_others_are_not(source: int) -> None:
    """The ego's own least of all."""
    run = recording() | {"facilities.packets": broadcasts(source)}
    assert asdict(compute(Traces(run)).prr) == NOTHING_SENT


def test_without_an_ego_no_packet_is_for_it() -> None:
    traces = Traces(recording() | {"facilities.packets": broadcasts(3)})
    nobody = Roles(ego=NO_VEHICLE, hidden=2, sharing=3)
    found = packet_reception(traces.packets, traces.receptions, nobody, traces.end)
    assert asdict(found) == NOTHING_SENT


def test_the_last_hop_that_was_tried_says_why_a_packet_was_lost() -> None:
    heard = [
        reception(0, 7, "R"),
        reception(0, 1, "C", hop=1),
        reception(1, 7, "B"),
        reception(1, 1, "N", addressed=0),  # overheard: not the ego's turn
        reception(2, 7, "R"),  # and never heard of again
    ]
    run = recording() | {
        "channel.receptions": Samples([b"", frame("RCPT", np.concatenate(heard)), b""]),
    }
    third = pytest.approx(1 / 3)
    assert asdict(compute(Traces(run)).prr)["lost"] == LOST_TO_NOTHING | {
        "interference": third,
        "receiver_busy": third,
        "unnoticed": third,
    }


def test_scans_count_from_the_first_trigger_on_whatever_was_sent() -> None:
    trigger = {"perception.match.trigger": Samples([np.array(k == 1) for k in range(3)])}
    one = {"facilities.packets": Samples([frame("PKTS", packet(0)), b"", b""])}
    found = compute(Traces(recording() | trigger | one)).session
    assert asdict(found) == {"begin": pytest.approx(0.1), "scans": 1, "served": 1.0}
    silent = {"facilities.packets": Samples([b""] * 3)}
    found = compute(Traces(recording() | trigger | silent)).session
    assert found.served == 0.0


def test_without_a_trigger_there_is_no_session() -> None:
    never = {"perception.match.trigger": Samples([np.array(False)] * 3)}
    found = compute(Traces(recording() | never)).session
    assert asdict(found) == {"begin": None, "scans": 0, "served": None}


def by_ends(found: Metrics) -> dict[tuple[int, int], Link]:
    return {(link.transmitter, link.receiver): link for link in found.links}


def test_links_count_every_transmission_once() -> None:
    found = by_ends(compute(Traces(recording())))
    assert found[3, 1].packets == 3
    assert found[3, 1].prr == pytest.approx(1 / 3)
    assert found[7, 1].prr == 1.0
    assert found[3, 7].classes == {"LOS": 0, "NLOSv": 1, "NLOSb": 0}


def test_a_channel_that_does_not_know_the_power_is_reported_as_such(tmp_path: Path) -> None:
    """A replayed recording has NaN for power and SNIR; metrics must still be JSON."""
    blind = [unframe("RCPT", data, RECEPTION).copy() for data in heard_in(recording())]
    for rows in blind:
        rows["power_dbm"] = rows["snir_db"] = np.nan
    run = recording() | {"channel.receptions": Samples([frame("RCPT", rows) for rows in blind])}
    found = compute(Traces(run))
    assert {link.mean_power_dbm for link in found.links} == {None}
    json.dumps(asdict(found), allow_nan=False)
    assert "mean power unknown" in RedLightReport().summary(asdict(found), {})
    figure.draw(Traces(run), found, tmp_path / "run.png")


def test_powers_that_are_known_are_averaged() -> None:
    partly = [unframe("RCPT", data, RECEPTION).copy() for data in heard_in(recording())]
    partly[1]["power_dbm"][:2] = np.nan, -80
    run = recording() | {"channel.receptions": Samples([frame("RCPT", rows) for rows in partly])}
    links = by_ends(compute(Traces(run)))
    assert links[3, 1].mean_power_dbm == pytest.approx(-85)


def test_a_run_without_sensor_data_has_no_prr() -> None:
    empty = recording() | {"facilities.packets": Samples([b""] * 3)}
    assert asdict(compute(Traces(empty)).prr) == NOTHING_SENT


def test_the_gap_is_the_distance_of_the_bodies() -> None:
    """Fronts at y = 2, the other body's lower side at y = 19: 17 m, then 7 m, then overlap."""
    np.testing.assert_allclose(Traces(recording()).gap_to_hidden[:, 1], [17.0, 7.0, 0.0])


def test_the_figure_is_drawn_at_the_decisive_moment(tmp_path: Path) -> None:
    data = Traces(recording())
    found = compute(data)
    assert figure.decisive_moment(found, data) == 2 * TENTH
    figure.draw(data, found, tmp_path / "run.png")
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_metrics_come_back_from_their_file() -> None:
    found = compute(Traces(recording()))
    assert from_json(json.loads(json.dumps(asdict(found))), Metrics) == found
