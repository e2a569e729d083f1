"""A remote component is a component: the same bytes, the same errors, through encoded messages."""

import importlib
import json
import logging
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.kinds import FrozenMapping
from orchestrator.parameters import PythonComponentType
from orchestrator.randomness import stream
from orchestrator.remote.block import WireError
from orchestrator.remote.declarations import connectors_from_message, connectors_to_message
from orchestrator.remote.host import ComponentHost
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import (
    Kind,
    Message,
    generator_from_document,
    generator_to_document,
)
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Causality, Connector
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from tests.orchestrator.packages.structured_units import Start
from tests.orchestrator.test_structured_parameters import ENTITY_MAPPINGS


@pytest.fixture
def units(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_units`, importable here."""
    monkeypatch.syspath_prepend(Path(__file__).parent / "packages")
    yield importlib.import_module("remote_units")
    sys.modules.pop("remote_units", None)
    sys.modules.pop("remote_runs", None)


@pytest.fixture
def runs(units: ModuleType) -> ModuleType:
    """The module `remote_runs`."""
    return importlib.import_module("remote_runs")


def test_the_loopback_gives_the_bytes_of_a_local_run(
    runs: ModuleType, units: ModuleType, tmp_path: Path
) -> None:
    specs = runs.swarms(tmp_path)
    kind = PythonComponentType(units.Swarm)
    local = runs.run_swarms({spec.name: kind.create(spec.name, spec.values) for spec in specs})
    with launch(specs, LoopbackTransport()) as components:
        remote = runs.run_swarms(components)
        again = runs.run_swarms(components)
    assert len(local.bits) == 101 * 2 * 7
    assert remote.bits == local.bits
    assert again.bits == local.bits  # after `close`, `setup` repeats the run


def test_a_further_run_begins_with_nothing_said_though_all_values_are_the_same_objects(
    units: ModuleType,
) -> None:
    """What did not change since the last message is not sent; a new run has no last message."""
    specs = [ComponentSpec(name="a", type="remote_units:Steady", values={})]
    given = np.array([1.0, 2.0])
    with launch(specs, LoopbackTransport()) as components:
        component = components["a"]
        for _ in range(3):
            component.setup(0, stream(1, "a"))
            component.initialise({"u": given})
            for t in range(2):
                component.step({"u": given}, t, 1)
                found = component.outputs()
                assert np.asarray(found["y"]).tolist() == [3.0, 4.0]
                assert np.asarray(found["seen"]).tolist() == [1.0, 2.0]
        component.close()


def test_an_input_that_never_changes_is_one_object_for_the_remote_component(
    runs: ModuleType, tmp_path: Path
) -> None:
    with launch(runs.swarms(tmp_path), LoopbackTransport()) as components:
        trace = runs.run_swarms(components, steps=20)
    # its start value, the value after initialisation, and nothing new in 20 steps
    assert [int(trace.last[name]["changes"]) for name in ("near", "far")] == [2, 1]


def test_connectors_arrive_whole(runs: ModuleType, units: ModuleType, tmp_path: Path) -> None:
    specs = runs.swarms(tmp_path)
    declared = units.Swarm(units.Swarm.Parameters()).connectors
    with launch(specs, LoopbackTransport()) as components:
        found = components["near"].connectors
    assert list(found) == list(declared)
    for name, connector in declared.items():
        for field in Connector.__dataclass_fields__:
            if field not in ("start", "dtype"):
                assert getattr(found[name], field) == getattr(connector, field), (name, field)
        assert found[name].kind() == connector.kind()
        start, expected = found[name].start_value(), connector.start_value()
        assert np.asarray(start).tobytes() == np.asarray(expected).tobytes()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"deed": "raise"}, "component `b` at t = 0.02 s: ValueError: the moon is too bright"),
        ({"deed": "exit"}, "component `b` at t = 0.02 s: SystemExit: 3"),
        (
            {"deed": "raise", "where": "setup"},
            "component `b` at t = 0 s: ValueError: the moon is too bright",
        ),
        (
            {"deed": "raise", "where": "close"},
            "component `b`: while closing: ValueError: the moon is too bright",
        ),
        (
            {"deed": "write_nonsense"},
            (
                "component `b` at t = 0.02 s: output `pid` is float, neither an array nor bytes; "
                "write `np.asarray(...)`"
            ),
        ),
    ],
)
def test_errors_keep_name_time_and_text(
    runs: ModuleType, values: dict[str, Any], message: str
) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(LoopbackTransport(), **values)
    assert str(caught.value) == message
    assert bool(caught.value.where) == ("ValueError" in message or "SystemExit" in message)
    assert ", in " in caught.value.where or not caught.value.where


def test_the_traceback_in_the_host_goes_to_the_log_of_a_run(
    runs: ModuleType, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO), pytest.raises(ComponentError):
        runs.run_reckless(LoopbackTransport(), deed="raise")
    assert "in _raise\n" in caplog.text


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        ("remote_units:Swarm", {"weights": object()}, "parameter `weights` is object, which can"),
        ("remote_units:Missing", {}, "component `x`: cannot load `remote_units:Missing`: Attrib"),
        ("no_such_module:X", {}, "cannot load `no_such_module:X`: ModuleNotFoundError: No module"),
        ("remote_units:DEEDS", {}, "`remote_units:DEEDS` is not a subclass of `Component`"),
        (
            "remote_units:Reckless",
            {"deed": "refuse", "where": "create"},
            "component `x`: `most` and `least` contradict each other",
        ),
        (Path("/no/such.fmu"), {}, "component `x`: there is no file `/no/such.fmu`"),
    ],
)
def test_a_component_that_cannot_be_created(
    units: ModuleType, kind: str | Path, values: dict[str, Any], message: str
) -> None:
    spec = ComponentSpec(name="x", type=kind, values=values)
    with pytest.raises(ComponentTypeError) as caught, launch([spec], LoopbackTransport()):
        pass
    assert message in str(caught.value)


def test_all_components_that_cannot_be_created_are_reported_at_once() -> None:
    specs = [ComponentSpec(name=n, type="no_such_module:X", values={}) for n in ("x", "y")]
    with (
        pytest.raises(ComponentTypeError, match=r"(?s)`x`: cannot load.*\n.*`y`: cannot load"),
        launch(specs, LoopbackTransport()),
    ):
        pass


plain = st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(),
                  st.builds(Path, st.sampled_from(["a/b.xml", "/c d", "."])))  # fmt: skip


@given(st.dictionaries(st.text(), st.one_of(plain, st.lists(plain).map(tuple)), max_size=4))
def test_parameter_values_keep_value_and_type(values: dict[str, Any]) -> None:
    spec = ComponentSpec(name="x", type="t", values=values)
    command = Message(kind=Kind.CREATE, epoch=0, sequence=1, document=spec.to_document())
    decoded, _ = Message.decode(command.encode())
    found = ComponentSpec.from_document(decoded.document)
    assert found == spec
    assert repr(found) == repr(spec)  # True is not 1, and -0.0 is not 0.0


def travelled(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Parameter values as they arrive."""
    document = ComponentSpec(name="x", type="t", values=values).to_document()
    return ComponentSpec.from_document(json.loads(json.dumps(document))).values


@given(ENTITY_MAPPINGS)
def test_structured_values_keep_their_order_and_type(entities: FrozenMapping[Any]) -> None:
    values = {"entities": entities, "start": (Start(lane="a"),)}
    arrived = travelled(values)
    assert arrived == values
    assert repr(arrived) == repr(values)


def test_what_is_no_record_does_not_travel() -> None:
    @dataclass(frozen=True)
    class Local:
        x: int = 1

    for value in (Local(), object(), {1, 2}):
        with pytest.raises(ComponentTypeError, match=r"`a` is .* which cannot travel"):
            travelled({"a": value})


@pytest.mark.parametrize("reference", ["no_such_module:X", "pathlib:Path", "os:no.such"])
def test_what_is_not_a_record_here_is_refused(reference: str) -> None:
    plain_record = {"record": reference, "fields": {}}
    document = {"name": "x", "type": "t", "values": {"a": plain_record}}
    with pytest.raises(ComponentTypeError, match=r"is not a record|install the same release"):
        ComponentSpec.from_document(document)


@given(st.integers(0, 2**63), st.integers(0, 5))
def test_a_random_stream_continues_where_it_was(seed: int, drawn: int) -> None:
    rng = stream(seed, "channel")
    rng.random(drawn, dtype=np.float32)  # an odd number leaves half a word in the generator
    message = Message(kind=Kind.SETUP, epoch=1, sequence=2, document=generator_to_document(rng))
    copy = generator_from_document(Message.decode(message.encode())[0].document)
    for one, other in ((rng, copy), (rng.spawn(1)[0], copy.spawn(1)[0])):
        assert one.random(3, dtype=np.float32).tobytes() == (
            other.random(3, dtype=np.float32).tobytes()
        )
        assert one.normal(size=5).tobytes() == other.normal(size=5).tobytes()


GOOD = Message(kind=Kind.STEP, epoch=1, sequence=2, t=3, h=4, document={"a": [1]}).encode()


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (b"", "0 bytes are too short"),
        (b"HTTP/1.1 400 Bad Request" + bytes(40), "starts with b'NLOS', not b'HTTP'"),
        (GOOD[:4] + b"\x07" + GOOD[5:], "speaks version 7 .* this is version 5; install the same"),
        (GOOD[:6] + b"\x63" + GOOD[7:], "unknown kind 99"),
        (GOOD[:-16], "ends too early"),
        (GOOD[:48] + b"[" + GOOD[49:], "cannot be read"),
    ],
)
def test_a_damaged_message_is_refused(message: bytes, complaint: str) -> None:
    with pytest.raises(WireError, match=complaint):
        Message.decode(message)


@given(st.binary(max_size=120), st.booleans())
def test_garbage_never_passes_for_a_message(tail: bytes, has_head: bool) -> None:  # noqa: FBT001
    try:
        message, offset = Message.decode(GOOD[:8] + tail if has_head else tail)
    except WireError:
        return
    assert offset <= 8 + len(tail)
    assert isinstance(message.document, dict)


def test_a_host_answers_a_command_that_comes_too_early() -> None:
    command = Message(kind=Kind.STEP, epoch=1, sequence=7)
    reply, _ = Message.decode(ComponentHost().handle(command.encode()))
    assert (reply.kind, reply.epoch, reply.sequence) == (Kind.FAILED, 1, 7)
    assert reply.document["failure"]["text"] == "the component was not created yet"


def run_in_a_ring(runs: ModuleType, components: Mapping[str, Component]) -> Any:
    """The trace of three components in a ring, stepped until they agree."""
    names = list(components)
    wires = [
        Connection(Endpoint(name, "y"), Endpoint(names[k - 1], "u")) for k, name in enumerate(names)
    ]
    trace = runs.Trace()
    system = System(components, dict.fromkeys(components, runs.STEP), wires)
    simulate(system, FixedPoint(), start=0, stop=20 * runs.STEP, seed=3, observers=[trace])
    return trace


def test_steps_are_taken_back_elsewhere_as_they_are_here(
    runs: ModuleType, units: ModuleType
) -> None:
    """The same bytes; and a host keeps no more states than somebody here holds."""
    names = ("a", "b", "c")
    local = run_in_a_ring(runs, {name: units.Drawing() for name in names})
    specs = [ComponentSpec(name=name, type="remote_units:Drawing", values={}) for name in names[1:]]
    kept: list[int] = []
    with launch(specs, LoopbackTransport()) as components:
        b = components["b"]
        host = b._component._dialogue._link._host  # type: ignore[attr-defined]
        restorable = host._restorable

        def counted() -> Any:
            kept.append(len(host._states))
            return restorable()

        host._restorable = counted
        remote = run_in_a_ring(runs, {"a": units.Drawing(), **components})
    assert remote.bits == local.bits
    assert len(kept) > 20 * 5
    assert max(kept) <= 2


def test_who_cannot_return_here_cannot_elsewhere(runs: ModuleType, tmp_path: Path) -> None:
    with launch(runs.swarms(tmp_path), LoopbackTransport()) as components:
        assert not any(isinstance(each, RestorableComponent) for each in components.values())


@pytest.mark.parametrize(("kind", "u"), [("Steady", [1.0, 2.0]), ("Drawing", 1.0)])
def test_a_component_elsewhere_says_whether_its_step_is_done(
    units: ModuleType, kind: str, u: float | list[float]
) -> None:
    """Also one that can return to an earlier state; a process says so in its own time."""
    specs = [ComponentSpec(name="a", type=f"remote_units:{kind}", values={})]
    with launch(specs, LocalTransport()) as components:
        component = components["a"]
        assert isinstance(component, RestorableComponent) == (kind == "Drawing")
        component.setup(0, stream(1, "a"))
        component.initialise({"u": np.array(u)})
        assert not component.has_finished()  # there is no step
        component.begin_step({"u": np.array(u)}, 0, 1)
        deadline = monotonic() + 20
        while not component.has_finished():
            assert monotonic() < deadline
        component.finish_step()
        assert not component.has_finished()
        component.close()


def test_a_state_that_is_not_there_is_an_error_of_the_component(units: ModuleType) -> None:
    """One of an earlier run: the host has forgotten it, and says so."""
    specs = [ComponentSpec(name="a", type="remote_units:Drawing", values={})]
    with launch(specs, LoopbackTransport()) as components:
        component = components["a"]
        assert isinstance(component, RestorableComponent)
        component.setup(0, stream(1, "a"))
        state = component.save()
        component.setup(0, stream(1, "a"))
        with pytest.raises(ComponentError, match=r"there is no state \d+ of this run"):
            component.restore(state)
        component.close()


@pytest.mark.parametrize("pool", [10**9, 5, None])
def test_a_random_stream_takes_the_memory_of_ours_only(pool: int | None) -> None:
    """NumPy works for hours on a pool of a billion words."""
    document = generator_to_document(np.random.default_rng(3))
    document["seeds"] |= {"pool_size": pool}
    with pytest.raises(ValueError, match="has a pool of 4 words"):
        generator_from_document(document)


@pytest.mark.parametrize(("key", "value"), [("meaning", 0), ("meaning", ""), ("undriven", [])])
def test_what_says_nothing_sound_of_a_connector_is_no_connector(key: str, value: object) -> None:
    connectors = {"y": Connector(causality=Causality.OUTPUT)}
    message = connectors_to_message(connectors, Message(Kind.CREATE, 1, 1), {})
    command, offset = Message.decode(message)
    said = dict(command.document["connectors"]["y"]) | {key: value}
    with pytest.raises((TypeError, IndexError)):
        connectors_from_message({"connectors": {"y": said}}, message, offset)
