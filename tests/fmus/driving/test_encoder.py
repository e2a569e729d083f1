"""The component that makes messages of scans."""

from pathlib import Path

import numpy as np
import pytest

from fmus.driving.encoder import FeatureEncoder
from fmus.driving.network.architecture import Architecture
from fmus.driving.network.cloud import clouds
from fmus.driving.network.sensors import Sender
from fmus.messages.features import FeaturesMessage, read_features, write_features
from fmus.messages.records import FEATURES_MIME
from orchestrator.errors import ComponentTypeError
from orchestrator.testing import check_component
from tests.fmus.driving.network.world import (
    PERIOD,
    SMALL,
    changed,
    network,
    turn,
)

EGO = 4


def points(k: int, *vehicles: int) -> bytes:
    """The scans of some vehicles at the time number `k`."""
    return turn(k, {vehicle: (0.5 * k, float(vehicle)) for vehicle in vehicles})


def encoder(path: Path, architecture: Architecture = SMALL) -> FeatureEncoder:
    network(architecture).write(path / "a.safetensors")
    made = FeatureEncoder(FeatureEncoder.Parameters(network=str(path / "a.safetensors")))
    made.setup(0, np.random.default_rng(0))
    return made


def step(component: FeatureEncoder, signal: bytes, k: int, ego: int = EGO) -> bytes:
    component.step({"points": signal, "ego.id": np.array(ego)}, (k - 1) * PERIOD, PERIOD)
    return bytes(component.outputs()["features"])


def sent(data: bytes) -> list[tuple[int, int]]:
    """Vehicle and time of each message."""
    return [(message.vehicle, message.time // PERIOD) for message in read_features(data)]


def expected(*signals: bytes) -> FeaturesMessage:
    """What the one vehicle in these signals sends last."""
    sender = Sender(network())
    for signal in signals:
        (cloud,) = clouds(signal)
        message = sender.message(cloud)
    return message


def test_everybody_sends_but_the_ego(tmp_path: Path) -> None:
    component = encoder(tmp_path)
    assert sent(step(component, points(1, 2, EGO, 7), 1)) == [(2, 1), (7, 1)]
    assert step(component, points(2, EGO), 2) == b""
    assert step(component, b"", 3) == b""
    assert sent(step(component, points(4, 2, EGO, 7), 4, ego=7)) == [(2, 4), (EGO, 4)]


def test_each_encodes_its_own_scans_alone(tmp_path: Path) -> None:
    """Who else is there changes nothing; who has not been there for a scan has no history."""
    component, alone = encoder(tmp_path), encoder(tmp_path)
    for k in range(1, 5):
        together = read_features(step(component, points(k, 2, 3), k))
        (by_itself,) = read_features(step(alone, points(k, 3), k))
        assert together[1].keypoints.tobytes() == by_itself.keypoints.tobytes()
    known = expected(*(points(k, 3) for k in range(1, 5)))
    assert by_itself.keypoints.tobytes() == known.keypoints.tobytes()
    step(component, points(5, 2), 5)
    _, back = read_features(step(component, points(6, 2, 3), 6))
    assert back.keypoints.tobytes() == expected(points(6, 3)).keypoints.tobytes()


def test_the_same_points_again_are_the_same_message(tmp_path: Path) -> None:
    """A lidar that scans more seldom than the encoder steps; equal bytes, whatever object."""
    component = encoder(tmp_path)
    step(component, points(1, 2), 1)
    once = step(component, points(2, 2), 2)
    assert step(component, bytes(bytearray(points(2, 2))), 3) == once
    (after,) = read_features(step(component, points(3, 2), 4))
    assert (
        after.keypoints.tobytes()
        == expected(*(points(k, 2) for k in (1, 2, 3))).keypoints.tobytes()
    )


def test_a_message_has_the_size_of_its_network(tmp_path: Path) -> None:
    """32 keypoints of 3 + 256 numbers are 33,152 bytes, padding included."""
    component = encoder(tmp_path, Architecture(keypoints=32, features=256, spacing=6))
    (message,) = read_features(step(component, points(1, 2), 1))
    assert message.size == 33_152
    assert 0 < len(message.keypoints) <= 32


def test_with_early_fusion_all_points_are_sent(tmp_path: Path) -> None:
    component = encoder(tmp_path, changed(early=True))
    signal = points(1, 2)
    (message,) = read_features(step(component, signal, 1))
    (cloud,) = clouds(signal)
    assert (message.dimensions, len(message.keypoints)) == (0, len(cloud.x))


def test_without_a_network_nothing_is_sent() -> None:
    component = FeatureEncoder(FeatureEncoder.Parameters(network=""))
    component.setup(0, np.random.default_rng(0))
    assert step(component, points(1, 2), 1) == b""


def test_an_unknown_network_is_refused_when_it_is_created() -> None:
    with pytest.raises(ComponentTypeError, match="there is no network `nonsense`"):
        FeatureEncoder(FeatureEncoder.Parameters(network="nonsense"))


def test_contract(tmp_path: Path) -> None:
    component = encoder(tmp_path)
    signals = [points(k, 2, EGO) for k in range(6)]
    check_component(
        component,
        steps=5,
        h=PERIOD,
        inputs=lambda t: {"points": signals[t // PERIOD], "ego.id": np.array(EGO)},
    )
    assert component.connectors["features"].mime_type == FEATURES_MIME
    assert component.connectors["features"].feedthrough == {"points", "ego.id"}
    assert write_features([]) != b""  # which is why silence is an empty signal
