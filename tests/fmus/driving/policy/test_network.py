"""Driving by a network: what it reads, when it encodes, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint, shipped
from fmus.driving.network.cloud import clouds
from fmus.driving.network.driver import DrivingNetwork
from fmus.driving.network.messages import seen, to_observed
from fmus.driving.network.sensors import BevSensor, Sender
from fmus.driving.policy import Inputs, Network
from fmus.driving.policy.connectors import INPUTS
from fmus.driving.policy.network import NetworkDriver
from fmus.messages.features import FeaturesMessage, write_features
from fmus.physics.plane import Frame
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array, Signal, Signals
from orchestrator.testing import check_component
from tests.fmus.driving.network.world import (
    PERIOD,
    SMALL,
    Sensor,
    changed,
    network,
    points_signal,
    turn,
)

STEP = 50_000_000
EGO, SHARER = 4, 9
SECOND = 1_000_000_000


def points(k: int, *vehicles: int) -> bytes:
    """The scans of some vehicles at the time number `k`; the ego drives, the others stand."""
    return turn(k, {v: (0.8 * k, 0.0) if v == EGO else (15.0, 5.0) for v in vehicles})


def message(k: int, checkpoint: Checkpoint) -> FeaturesMessage:
    """What the sharer sends of its scan number `k`, its first one."""
    (cloud,) = clouds(points(k, SHARER))
    return Sender(checkpoint).message(cloud)


def inputs(k: int, *messages: FeaturesMessage, **others: Signal) -> dict[str, Signal]:
    """At the time number `k`; of `others` the first underscore is a point."""
    given: dict[str, Signal] = {
        "ego.id": np.array(EGO),
        "ego.position": np.array([0.8 * k, 0.0]),
        "ego.heading": np.array(0.0),
        "ego.speed": np.array(8.0),
        "ego.size": np.array([4.9, 1.9, 1.5]),
        "ego.route": np.array([[0.8 * k, 0.0], [0.8 * k + 40.0, 3.0]]),
        "points": points(k, EGO),
        "objects": b"",
        "received.objects": b"",
        "received.features": write_features(messages) if messages else b"",
        "vehicle.id": np.zeros(0, np.int64),
        "vehicle.position": np.zeros((0, 3)),
        "vehicle.heading": np.zeros(0),
        "vehicle.velocity": np.zeros((0, 2)),
        "vehicle.size": np.zeros((0, 3)),
        "pose_error.vehicle": np.zeros(0, np.int64),
        "pose_error.position": np.zeros((0, 2)),
        "pose_error.heading": np.zeros(0),
    }
    return given | {name.replace("_", ".", 1): value for name, value in others.items()}


def driver(checkpoint: Checkpoint | None = None) -> NetworkDriver:
    return NetworkDriver(checkpoint or network(), 8.0, SECOND)


def policy(folder: Path, architecture: Architecture = SMALL) -> Network:
    path = folder / "a.safetensors"
    network(architecture).write(path)
    made = Network(Network.Parameters(network=str(path)))
    made.setup(0, np.random.default_rng(0))
    return made


def command(found: NetworkDriver, signals: Signals, now: int) -> Array:
    return found.command(Inputs.read(signals, frozenset(INPUTS)), now)


def drive(found: NetworkDriver, k: int, *messages: FeaturesMessage, **others: Signal) -> Array:
    return command(found, inputs(k, *messages, **others), k * PERIOD)


@pytest.mark.parametrize("cooperative", [True, False])
def test_it_reads_what_its_outputs_depend_on_and_nothing_else(
    tmp_path: Path, *, cooperative: bool
) -> None:
    component = policy(tmp_path, changed(cooperative=cooperative))
    reads = component.connectors["command"].feedthrough
    assert ("received.features" in reads) == cooperative
    everything = inputs(1)
    component.step({name: everything[name] for name in reads}, 0, STEP)
    for name in reads:
        component.setup(0, np.random.default_rng(0))
        with pytest.raises(KeyError, match=name):
            component.step({n: everything[n] for n in reads - {name}}, 0, STEP)


def test_it_is_encoder_fusion_and_head(tmp_path: Path) -> None:
    """Own scan and message, each with its age, by the parts that other tests are about."""
    checkpoint, found = network(), driver()
    sent, now = message(1, checkpoint), 2 * PERIOD + 12 * STEP
    driven = command(found, inputs(2, sent), now)
    (cloud,) = clouds(points(2, EGO))
    own = seen(cloud, BevSensor(checkpoint).encode(cloud), now)
    assert own.age == pytest.approx(0.6)
    expected = DrivingNetwork(SMALL, checkpoint.weights).drive(
        [own, to_observed(sent, now)],
        frame=Frame(x=1.6, y=0.0, heading=0.0),
        speed=8.0,
        wanted_speed=8.0,
        route=np.asarray(inputs(2)["ego.route"]),
    )
    assert driven.tobytes() == expected.tobytes()


def test_scans_grow_old() -> None:
    """With nothing new, the same scan says something else after a while."""
    found = driver()
    commands = [command(found, inputs(1), PERIOD + k * STEP).tobytes() for k in range(20)]
    assert len(set(commands)) > 2


def test_each_scan_is_encoded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the policy steps twice as often, and the signal may be another object then."""
    times: list[int] = []
    encode = BevSensor.encode

    def counted(self: BevSensor, cloud: Any, others: Any = ()) -> Any:
        times.append(cloud.time // PERIOD)
        return encode(self, cloud, others)

    monkeypatch.setattr(BevSensor, "encode", counted)
    found = driver()
    for k in (1, 2, 3):
        given = inputs(k)
        command(found, given, k * PERIOD)
        again = given | {"points": bytes(bytearray(np.frombuffer(bytes(given["points"]), "u1")))}
        command(found, again, k * PERIOD + STEP)
    assert times == [1, 2, 3]


def test_the_command_does_not_depend_on_which_objects_carry_the_signals() -> None:
    """Between processes signals are copied: equal bytes must drive alike."""
    one, other = driver(), driver()
    sent = message(1, network())
    for step in range(4, 12):
        now, k = step * STEP, step // 2
        given = inputs(k, sent)
        copied = {n: bytes(bytearray(v)) if isinstance(v, bytes) else v for n, v in given.items()}
        assert command(one, given, now).tobytes() == command(other, copied, now).tobytes()


def test_without_a_route_it_does_nothing() -> None:
    found = driver()
    for route in (np.zeros((0, 2)), np.zeros((1, 2)), np.ones((3, 2))):
        assert drive(found, 1, ego_route=route).tolist() == [0.0, 0.0, 0.0]


def test_messages_matter_until_they_are_too_old() -> None:
    sent = message(1, network())
    alone, together = driver(), driver()
    for k in (1, 6, 11):
        assert drive(alone, k).tobytes() != drive(together, k, sent).tobytes(), k
    assert drive(alone, 12).tobytes() == drive(together, 12, sent).tobytes()


def test_of_a_message_that_was_lost_in_part_the_rest_is_used() -> None:
    sent = message(1, network())
    commands = [
        drive(driver(), 2, replace(sent, keypoints=sent.keypoints[:count])).tobytes()
        for count in (0, 3, 8)
    ]
    assert commands[0] == drive(driver(), 2).tobytes()
    assert len(set(commands)) > 1


def test_an_own_scan_that_is_too_old_is_forgotten() -> None:
    found, blind = driver(), driver()
    drive(found, 1)
    empty = points_signal(Sensor(vehicle=EGO, points=np.zeros((0, 3)), time=PERIOD))
    drive(blind, 1, points=empty)
    gone = points(2, SHARER)
    assert drive(found, 2, points=gone).tobytes() != drive(blind, 2, points=gone).tobytes()
    assert drive(found, 11, points=gone).tobytes() != drive(blind, 11, points=gone).tobytes()
    assert drive(found, 12, points=gone).tobytes() == drive(blind, 12, points=gone).tobytes()


def test_a_network_that_is_not_cooperative_reads_no_message() -> None:
    checkpoint = network(changed(cooperative=False))
    sent = message(1, network(changed(features=14)))
    assert drive(driver(checkpoint), 1, sent).tobytes() == drive(driver(checkpoint), 1).tobytes()


@pytest.mark.parametrize(
    ("theirs", "ours", "numbers"),
    [
        (changed(features=14), SMALL, "14 features per keypoint, and this network reads 12"),
        (changed(early=True), SMALL, "0 features per keypoint, and this network reads 12"),
        (SMALL, changed(early=True), "12 features per keypoint, and this network reads 0"),
    ],
)
def test_messages_of_another_network_are_refused(
    theirs: Architecture, ours: Architecture, numbers: str
) -> None:
    with pytest.raises(
        ValueError, match=f"vehicle 9 sends {numbers}: give encoder and policy the same `network`"
    ):
        drive(driver(network(ours)), 1, message(1, network(theirs)))


@pytest.mark.parametrize("architecture", [SMALL, changed(vectors=0)])
def test_so_are_those_of_another_training(architecture: Architecture) -> None:
    """Sizes that agree are not enough; a message that does not say whose it is, is not, either."""
    sent = message(1, network(architecture, seed=1))
    for strange in (sent, replace(message(1, network()), encoder=0)):
        with pytest.raises(
            ValueError,
            match="vehicle 9 sends features of another encoder than the one that this network was "
            "trained with: give encoder and policy the same `network`",
        ):
            drive(driver(), 1, strange)


def test_what_is_behind_the_encoder_may_differ() -> None:
    ours = network()
    others = {name: -value for name, value in ours.weights.items() if "encoder" not in name}
    sent = message(1, replace(ours, weights={**ours.weights, **others}))
    assert drive(driver(), 1, sent).tobytes() == drive(driver(), 1, message(1, ours)).tobytes()


def test_early_fusion_lays_the_newest_cloud_of_each_sender_over_the_own_one() -> None:
    checkpoint = network(changed(early=True))
    (own,) = clouds(points(2, EGO))
    (other,) = clouds(points(1, SHARER))
    found = driver(checkpoint)
    driven = drive(found, 2, message(0, checkpoint), message(1, checkpoint))
    both = BevSensor(checkpoint).encode(own, [other])
    expected = DrivingNetwork(checkpoint.architecture, checkpoint.weights).drive(
        [seen(own, both, 2 * PERIOD)],
        frame=Frame(x=1.6, y=0.0, heading=0.0),
        speed=8.0,
        wanted_speed=8.0,
        route=np.asarray(inputs(2)["ego.route"]),
    )
    assert driven.tobytes() == expected.tobytes()
    assert driven.tobytes() != drive(driver(checkpoint), 2).tobytes()


def test_an_unknown_network_is_refused_when_it_is_created() -> None:
    with pytest.raises(ComponentTypeError, match="there is no network `nonsense`"):
        Network(Network.Parameters(network="nonsense"))


def test_it_is_named_beside_what_else_is_wrong_and_the_shipped_ones_are_offered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(
        "schema: 1\ntitle: two mistakes\nextends: red_light\ncomponents:\n"
        "  policy: {type: policy-network, parameters: {network: general-61, brake_hold: 1 m}}\n"
    )
    assert main(["check", str(file)]) == 2
    first, second = [line for line in capsys.readouterr().out.splitlines() if "policy" in line]
    assert "mine.yaml:5:56: components.policy.parameters.network: there is no `general-61`" in first
    assert first.endswith("did you mean `general-16`?")
    assert "mine.yaml:5:80: components.policy.parameters.brake_hold" in second
    for type_name in ("policy-network", "encoder", "policy-dagger"):
        assert main(["components", type_name]) == 0
        shown = " ".join(capsys.readouterr().out.split())  # lines end where the terminal does
        assert f"({', '.join(shipped())})" in shown
        assert main(["components", type_name, "--json"]) == 0
        said = json.loads(capsys.readouterr().out)["parameters"]["network"]["names"]
        assert [name for name in said if name] == shipped()


def test_contract(tmp_path: Path) -> None:
    sent = message(1, network())
    moments = [inputs(step // 2, sent) for step in range(8)]
    check_component(policy(tmp_path), steps=6, h=STEP, seed=1, inputs=lambda t: moments[t // STEP])
