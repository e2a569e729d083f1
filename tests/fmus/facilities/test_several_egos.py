"""Several egos: each has what was for it, and none changes what the first one has."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmus.facilities import AlwaysOnFacilities, CpmFacilities, Facilities
from fmus.facilities.connectors import CONNECTORS, of_ego
from fmus.facilities.layer import FacilitiesLayer
from fmus.facilities.streams import Streams
from fmus.messages.apm import read_header, split
from fmus.messages.records import NO_VEHICLE, REQUEST, SENSOR_DATA
from fmus.relay import Direct, Mohed
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.outputs import same
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array, Causality, Signal
from orchestrator.simulation import simulate
from orchestrator.system import System, expand
from orchestrator.testing import FunctionComponent, check_component
from tests.fmus.facilities.air import Town, asking
from tests.fmus.facilities.world import H

EGO, SHARER, RELAY, SECOND, THIRD = 10, 20, 30, 40, 50
KINDS: dict[str, Callable[..., FacilitiesLayer]] = {
    "on demand": lambda **given: Facilities(Facilities.Parameters(**given)),
    "what was demanded": lambda **given: Facilities(
        Facilities.Parameters(answer="demanded", **given)
    ),
    "CPMs": lambda **given: CpmFacilities(CpmFacilities.Parameters(**given)),
    "always on": lambda **given: AlwaysOnFacilities(AlwaysOnFacilities.Parameters(**given)),
}
THREE = ("first", "second", "third")


def three(**given: Any) -> FacilitiesLayer:
    return KINDS["on demand"](egos=THREE, **given)


def same_signals(left: dict[str, Signal], right: dict[str, Signal]) -> bool:
    return left.keys() == right.keys() and all(same(left[name], right[name]) for name in left)


def of_others(packets: Array, *without: int) -> bytes:
    """Packets, numbered by themselves, but for those of some vehicles and for them."""
    rows = packets[~np.isin(packets["source"], without)].copy()
    rows = rows[~np.isin(rows["destination"], [v for v in without if v != NO_VEHICLE])]
    rows["id"] = 0
    return rows.tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_one_ego_has_the_same_with_a_name_and_without(kind: str) -> None:
    unnamed = Town(KINDS[kind](), [EGO, SHARER, RELAY])
    named = Town(KINDS[kind](egos=("first",)), [EGO, SHARER, RELAY])
    for _ in range(60):
        given = asking(EGO, SHARER, RELAY)
        assert unnamed.step({"": given}).tobytes() == named.step({"first": given}).tobytes()
        assert same_signals(unnamed.received(""), named.received("first"))
    assert unnamed.objects("") != []


@pytest.mark.parametrize("kind", KINDS)
def test_egos_out_of_range_leave_the_signals_of_the_first_byte_for_byte(kind: str) -> None:
    """Whatever they send and ask for among themselves: times too are drawn as without them."""
    far = {SECOND, THIRD}

    def hears(receiver: int, source: int) -> bool:
        return receiver != source and (receiver in far) == (source in far)

    alone = Town(KINDS[kind](), [EGO, SHARER, RELAY])
    town = Town(KINDS[kind](egos=THREE), [EGO, SHARER, RELAY, SECOND, THIRD], hears)
    first = asking(EGO, SHARER, RELAY)
    for _ in range(80):
        expected = alone.step({"": first})
        further = {"second": asking(SECOND, THIRD), "third": asking(THIRD, SECOND)}
        sent = town.step({"first": first, **further})
        assert of_others(sent, *far) == of_others(expected)
        assert same_signals(town.received("first"), alone.received(""))
    assert town.objects("first") != []
    assert town.objects("second") != []


def test_answers_to_a_further_ego_leave_the_times_of_all_other_messages() -> None:
    """The sharer of the first ego serves the second one as well."""
    vehicles = [EGO, SHARER, RELAY, SECOND]
    given = {"first": asking(EGO, SHARER), "third": asking(NO_VEHICLE)}
    quiet, busy = Town(three(), vehicles), Town(three(), vehicles)
    for _ in range(80):
        expected = quiet.step({**given, "second": asking(SECOND)})
        sent = busy.step({**given, "second": asking(SECOND, SHARER, RELAY)})
        assert of_others(sent, SECOND) == of_others(expected, SECOND)
        assert same_signals(busy.received("first"), quiet.received("first"))
    assert (quiet.objects("second"), busy.objects("second")) == ([], [SHARER])


def test_each_of_three_receives_what_was_addressed_to_it() -> None:
    """The first asks the second over the third; the third asks the second; the second SHARER."""
    town = Town(three(sensor_data_size=3000), [EGO, SHARER, SECOND, THIRD])
    egos = {
        "first": asking(EGO, SECOND, THIRD),
        "second": asking(SECOND, SHARER, EGO),
        "third": asking(THIRD, SECOND),
    }
    sent = np.concatenate([town.step(egos) for _ in range(60)])
    town.step({**egos, "first": asking(EGO), "second": asking(SECOND), "third": asking(THIRD)})
    asked = sent[sent["kind"] == REQUEST]
    assert {(int(p["source"]), int(p["destination"]), int(p["route"][0])) for p in asked} == {
        (EGO, SECOND, THIRD),
        (SECOND, SHARER, EGO),
        (THIRD, SECOND, NO_VEHICLE),
    }
    assert [town.objects(name) for name in THREE] == [[SECOND], [SHARER], [SECOND]]
    data = sent[sent["kind"] == SENSOR_DATA]
    for name, vehicle in zip(THREE, (EGO, SECOND, THIRD), strict=True):
        for_it = np.count_nonzero(data["destination"] == vehicle)
        assert for_it == pytest.approx(3 * 6, abs=3)
        assert int(np.asarray(town.received(name)["received.sensor_data.count"])) == for_it


def test_what_an_ego_relays_is_not_for_it() -> None:
    town = Town(three(), [EGO, SHARER, SECOND])
    nobody = asking(NO_VEHICLE)
    for _ in range(60):
        town.step({"first": asking(EGO, SHARER, SECOND), "second": asking(SECOND), "third": nobody})
    assert (town.objects("first"), town.objects("second")) == ([SHARER], [])
    assert int(np.asarray(town.received("first")["received.sensor_data.count"])) > 0
    assert int(np.asarray(town.received("second")["received.sensor_data.count"])) == 0


def test_what_is_for_everybody_reaches_every_ego_but_its_source() -> None:
    town = Town(three(), [EGO, SECOND, THIRD])
    for _ in range(30):
        town.step({"first": asking(EGO), "second": asking(SECOND), "third": asking(THIRD)})
    for name, others in zip(THREE, ([SECOND, THIRD], [EGO, THIRD], [EGO, SECOND]), strict=True):
        known = town.received(name)
        assert np.asarray(known["received.bsm.id"]).tolist() == others
        apms = split(bytes(known["received.apms"]))
        assert [int(read_header(apm)["vehicle"]) for apm in apms] == others
        measured = np.asarray(known["received.link.receiver"])
        assert set(measured.tolist()) == {EGO, SECOND, THIRD} - set(others)


def test_an_ego_that_is_not_there_asks_nothing_and_knows_nothing() -> None:
    """It enters after 0.2 s, leaves after 1 s, and is forgotten by what it heard 1 s later."""
    town = Town(three(maximum_age=1.0), [EGO, SHARER, SECOND])
    first, absent = asking(EGO, SHARER), asking(NO_VEHICLE, SHARER)

    def run(steps: int, second: dict[str, Signal]) -> Array:
        egos = {"first": first, "second": second, "third": absent}
        return np.concatenate([town.step(egos) for _ in range(steps)])

    def lengths() -> dict[str, int]:
        known = town.received("second")
        count = known.pop("received.sensor_data.count")
        assert np.asarray(count).shape == ()
        bodies = ("received.apms", "received.objects", "received.features")
        empty = {name: town.received("third")[name] for name in bodies}
        return {
            name: int(value != empty[name]) if isinstance(value, bytes) else len(value)
            for name, value in known.items()
        }

    early = run(20, absent)
    assert set(early["source"][early["kind"] == REQUEST].tolist()) == {EGO}
    assert not any(lengths().values())
    there = run(80, asking(SECOND, SHARER))
    assert set(there["source"][there["kind"] == REQUEST].tolist()) == {EGO, SECOND}
    assert all(length for name, length in lengths().items() if name != "received.features")
    count = int(np.asarray(town.received("second")["received.sensor_data.count"]))
    later = run(110, absent)
    assert set(later["source"][later["kind"] == REQUEST].tolist()) == {EGO}
    assert not any(lengths().values())
    assert int(np.asarray(town.received("second")["received.sensor_data.count"])) == count
    assert town.objects("first") == [SHARER]


def finds(sharers: int, zones: int) -> FunctionComponent:
    """Stands for a perception unit that reports so many sharers and blind zones, unused."""
    match: dict[str, Signal] = {
        "match.sharer": np.full(sharers, NO_VEHICLE),
        "match.trigger": np.array(False),
        "blind_zone.center": np.zeros((zones, 2)),
        "blind_zone.range": np.zeros(zones),
    }
    connectors = {name: replace(CONNECTORS[name], causality=Causality.OUTPUT) for name in match}
    return FunctionComponent(connectors, lambda state, inputs, t: (state, match))


def test_units_of_each_ego_are_connected_by_groups() -> None:
    """Arrays along sharers and blind zones have a length of their own for each ego."""
    components: dict[str, Component] = {
        "facilities": KINDS["on demand"](egos=("first", "second")),
        "perception-first": finds(8, 32),
        "perception-second": finds(2, 5),
        "relay-first": Direct(),
        "relay-second": Mohed(Mohed.Parameters()),
    }
    links = [
        link
        for ego in ("first", "second")
        for source, target in (
            (f"perception-{ego}.match", f"facilities.{ego}.match"),
            (f"perception-{ego}.blind_zone", f"facilities.{ego}.blind_zone"),
            (f"perception-{ego}.match", f"relay-{ego}.match"),
            (f"relay-{ego}.relay", f"facilities.{ego}.relay"),
            (f"facilities.{ego}.received", f"relay-{ego}.received"),
        )
        for link in expand(components, source, target)
    ]
    system = System(components, dict.fromkeys(components, H), links)
    assert len(system.feeds["relay-second"]) == 12 + 2
    simulate(system, Jacobi(), start=0, stop=5 * H, seed=1)


@pytest.mark.parametrize("kind", KINDS)
def test_every_ego_has_its_connectors_and_axes_of_its_own(kind: str) -> None:
    found = KINDS[kind](egos=("near", "far")).connectors
    own = [name for name in CONNECTORS if of_ego("near", name) != name]
    assert len(found) == len(CONNECTORS) + len(own)
    assert {"near.id", "far.match.sharer", "near.blind_zone.center", "far.relay"} <= found.keys()
    assert found["near.received.bsm.position"].shape == ("near.neighbour", 2)
    assert found["near.received.link.power"].feedthrough == {"receptions", "near.match.sharer"}
    assert found["vehicle.position"] == CONNECTORS["vehicle.position"]
    for name in own:
        for ego in ("near", "far"):
            mine, other = found[of_ego(ego, name)], CONNECTORS[name]
            if mine.causality is Causality.OUTPUT:
                assert mine.differences(replace(other, causality=Causality.INPUT)) == []
            else:
                assert replace(other, causality=Causality.OUTPUT).differences(mine) == []


def test_names_that_cannot_be_told_apart_are_all_reported() -> None:
    with pytest.raises(ComponentTypeError) as error:
        KINDS["on demand"](egos=("vehicle", "a", "a.b", "a"))
    assert str(error.value).split("; ") == [
        "`egos`: `vehicle` is what connectors of all vehicles are called",
        "choose another",
        "`egos` names `a` 2 times",
        "name each ego once",
        "`egos`: `a.b` is no name",
        "write letters, digits, `_` and `-` (not first)",
    ]


def test_two_egos_in_one_vehicle_are_refused() -> None:
    town = Town(three(), [EGO])
    with pytest.raises(ValueError, match=r"`first.id` and `third.id` are both vehicle 10; connect"):
        town.step({"first": asking(EGO), "second": asking(NO_VEHICLE), "third": asking(EGO)})


def test_what_a_listener_did_not_receive_stays_the_same_object() -> None:
    """So that recorders and connections see at once that nothing changed."""
    town = Town(three(), [EGO, SHARER, SECOND])
    given = {name: asking(NO_VEHICLE) for name in THREE}
    town.step(given)
    before = town.received("first")["received.sensor_data.count"]
    for _ in range(5):
        town.step(given)
        assert town.received("first")["received.sensor_data.count"] is before


def test_a_further_ego_draws_from_its_own_stream_while_its_vehicle_may_be_answered() -> None:
    streams = Streams(np.random.default_rng(1), THREE)
    common = streams.of(EGO)
    streams.assign([EGO, SECOND, NO_VEHICLE])
    own = streams.of(SECOND)
    streams.assign([NO_VEHICLE, NO_VEHICLE, THIRD])
    assert streams.of(EGO) is streams.of(SHARER) is streams.of(NO_VEHICLE) is common
    assert streams.of(SECOND) is own
    assert len({id(common), id(own), id(streams.of(THIRD))}) == 3
    again = Streams(np.random.default_rng(1), ("other", "third", "second"))
    again.assign([NO_VEHICLE, THIRD, SECOND])
    assert again.of(SECOND).random(4).tolist() == own.random(4).tolist()


def test_streams_that_are_renewed_are_those_of_the_new_stream() -> None:
    """Of every ego its own again, also for a vehicle that was one before."""
    streams = Streams(np.random.default_rng(1), THREE)
    streams.assign([EGO, SECOND, NO_VEHICLE])
    streams.assign([EGO, NO_VEHICLE, THIRD])
    streams.renew(np.random.default_rng(2))
    fresh = Streams(np.random.default_rng(2), THREE)
    fresh.assign([EGO, SECOND, THIRD])
    for vehicle in (EGO, SECOND, THIRD):
        assert streams.of(vehicle).random(4).tolist() == fresh.of(vehicle).random(4).tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_contract(kind: str) -> None:
    check_component(KINDS[kind](egos=THREE), steps=30, h=H, seed=1)
