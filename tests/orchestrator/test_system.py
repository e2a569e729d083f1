"""A system is checked when it is created: everything that is wrong, at once."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from orchestrator.component import Component
from orchestrator.errors import SystemStructureError
from orchestrator.signal import Causality, Connector
from orchestrator.system import Connection, Endpoint, Feed, System, expand
from orchestrator.testing import FunctionComponent


def component(**connectors: Connector) -> Component:
    named = {name.replace("__", "."): connector for name, connector in connectors.items()}
    return FunctionComponent(named, lambda state, inputs, t: (state, {}))


def output(**fields: Any) -> Connector:
    return Connector(causality=Causality.OUTPUT, **fields)


def input_(**fields: Any) -> Connector:
    return Connector(causality=Causality.INPUT, **fields)


def connect(source: str, target: str) -> Connection:
    return Connection(Endpoint.parse(source), Endpoint.parse(target))


@pytest.fixture
def components() -> Mapping[str, Component]:
    return {
        "traffic": component(
            vehicle__position=output(shape=("vehicle", 3), unit="m"),
            vehicle__heading=output(shape=("vehicle",), unit="rad"),
            gap=output(unit="m"),
        ),
        "channel": component(
            vehicle__position=input_(shape=("vehicle", 3), unit="m"),
            vehicle__heading=input_(shape=("vehicle",), unit="rad"),
            power=input_(unit="W"),
            received=output(dtype=None),
        ),
    }


STEPS = {"traffic": 50, "channel": 10}


def problems(components: Mapping[str, Component], *connections: Connection) -> tuple[str, ...]:
    with pytest.raises(SystemStructureError) as error:
        System(components, STEPS, connections)
    return error.value.problems


def test_an_endpoint_splits_at_the_first_dot() -> None:
    assert Endpoint.parse("a.vehicle.position") == Endpoint("a", "vehicle.position")
    assert str(Endpoint("a", "vehicle.position")) == "a.vehicle.position"
    for text in ("a", "a.", ".b", ""):
        with pytest.raises(ValueError, match=r"names no connector; write `component.connector`"):
            Endpoint.parse(text)


def test_a_group_connects_every_input_beneath_it(components: Mapping[str, Component]) -> None:
    connections = expand(components, "traffic.vehicle", "channel.vehicle")
    assert [str(connection) for connection in connections] == [
        "`traffic.vehicle.position` to `channel.vehicle.position`",
        "`traffic.vehicle.heading` to `channel.vehicle.heading`",
    ]
    system = System(components, STEPS, connections)
    assert system.feeds["traffic"] == ()
    assert system.feeds["channel"] == (
        Feed("vehicle.position", "traffic", "vehicle.position"),
        Feed("vehicle.heading", "traffic", "vehicle.heading"),
    )


def test_a_single_connection_expands_to_itself(components: Mapping[str, Component]) -> None:
    expected = (connect("traffic.gap", "channel.power"),)
    assert expand(components, "traffic.gap", "channel.power") == expected


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("trafic.gap", "channel.power", "no component `trafic`; did you mean `traffic`?"),
        ("traffic.gap", "chanel.power", "no component `chanel`; did you mean `channel`?"),
        ("traffic.gab", "channel.power", "no connector `gab`; did you mean `gap`?"),
        (
            "traffic.vehicle",
            "channel.vehicel",
            "`channel` has no input `vehicel`, nor any beneath it; did you mean `vehicle`?",
        ),
        (
            "traffic.vehicles",
            "channel.vehicle",
            (
                "cannot connect `traffic.vehicles.heading` to `channel.vehicle.heading`: "
                "`traffic` has no connector `vehicles.heading`; did you mean `vehicle.heading`?"
            ),
        ),
        ("traffic", "channel.vehicle", "`traffic` names no connector"),
        ("channel.received", "traffic.vehicle", "`traffic` has no input `vehicle`"),
    ],
)
def test_an_end_that_does_not_exist_is_answered_with_what_does(
    components: Mapping[str, Component], source: str, target: str, message: str
) -> None:
    with pytest.raises(SystemStructureError) as error:
        expand(components, source, target)
    assert message in str(error.value)
    assert f"cannot connect `{source}" in str(error.value)


def test_a_group_reports_each_input_without_a_source(components: Mapping[str, Component]) -> None:
    with pytest.raises(SystemStructureError) as error:
        expand(components, "channel.vehicle2", "channel.vehicle")
    assert len(error.value.problems) == 2


def test_all_problems_are_reported_at_once(components: Mapping[str, Component]) -> None:
    found = problems(
        components,
        connect("traffic.gap", "channel.power"),
        connect("traffic.gap", "channel.power"),
        connect("traffic.vehicle.heading", "channel.vehicle.position"),
        connect("channel.received", "channel.powr"),
        connect("lidar.points", "channel.power"),
        connect("channel.power", "traffic.gap"),
    )
    assert found == (
        (
            "cannot connect `traffic.gap` to `channel.power`: units differ: m and W; "
            "`convert: false` would take the number as it is"
        ),
        (
            "cannot connect `traffic.gap` to `channel.power`: units differ: m and W; "
            "`convert: false` would take the number as it is; `traffic.gap` drives it already"
        ),
        (
            "cannot connect `traffic.vehicle.heading` to `channel.vehicle.position`: "
            "shapes differ: ('vehicle',) and ('vehicle', 3); units differ: rad and m; "
            "`convert: false` would take the number as it is"
        ),
        (
            "cannot connect `channel.received` to `channel.powr`: `channel` has no connector "
            "`powr`; did you mean `power`?"
        ),
        (
            "cannot connect `lidar.points` to `channel.power`: there is no component `lidar`; "
            "there are: channel, traffic; `traffic.gap` drives it already"
        ),
        (
            "cannot connect `channel.power` to `traffic.gap`: the source is an input, not an "
            "output; the target is an output, not an input; units differ: W and m"
        ),
        (
            "`channel.vehicle.heading`: no source, but `channel.vehicle.position` along the same "
            "axis `vehicle` has one; connect all inputs along `vehicle` or none"
        ),
    )


def test_step_sizes_belong_to_components_and_are_positive() -> None:
    parts = {"fast": component(), "slow": component(), "a.b": component()}
    with pytest.raises(SystemStructureError) as error:
        System(parts, {"fast": 0, "slov": 10, "a.b": 1}, [])
    assert error.value.problems == (
        "component `fast`: its step size must be positive, got 0 ns",
        "component `slow` has no step size",
        "`a.b` cannot be the name of a component; write letters, digits, `_` and `-` (not first)",
        "a step size is given for `slov`; did you mean `slow`?",
    )


def test_an_instance_takes_part_once() -> None:
    one = component()
    with pytest.raises(SystemStructureError, match="`a` and `b` are one and the same instance"):
        System({"a": one, "b": one}, {"a": 1, "b": 1}, [])


def test_a_system_has_components() -> None:
    with pytest.raises(SystemStructureError, match="the system has no components"):
        System({}, {}, [])


def test_declarations_that_contradict_themselves_are_problems() -> None:
    broken = component(
        u=input_(start=np.array([1.0, 2.0])),
        y=output(feedthrough=frozenset({"v"})),
        n=output(dtype=np.int64, start=np.array("many")),
    )
    with pytest.raises(SystemStructureError) as error:
        System({"broken": broken}, {"broken": 1}, [])
    assert error.value.problems == (
        "`broken.u`: its start value is float64[2], declared float64[]",
        "`broken.n`: its start value invalid literal for int() with base 10: np.str_('many')",
        "`broken.y` declares feedthrough from `v`, which is not an input of `broken`; there are: u",
    )


def test_events_may_not_be_missed_by_a_reader_with_a_longer_step() -> None:
    mime = "application/x-messages; version=1; events"
    sender = FunctionComponent(
        {"sent": Connector(causality=Causality.OUTPUT, dtype=None, mime_type=mime)},
        lambda state, inputs, t: (state, {"sent": b""}),
    )
    reader = FunctionComponent(
        {"heard": Connector(causality=Causality.INPUT, dtype=None, mime_type=mime)},
        lambda state, inputs, t: (state, {}),
    )
    link = Connection(Endpoint("sender", "sent"), Endpoint("reader", "heard"))
    components = {"sender": sender, "reader": reader}
    for reading in (5, 10):
        System(components, {"sender": 10, "reader": reading}, [link])
    with pytest.raises(SystemStructureError, match="20 ns would miss those of `sender`"):
        System(components, {"sender": 10, "reader": 20}, [link])
