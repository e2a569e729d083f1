"""The point transformer as an encoder of driving networks: what is stored, encoded and sent."""

import dataclasses
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from fmus.driving.encoder import FeatureEncoder
from fmus.driving.network.architecture import POINT_TRANSFORMER, Architecture
from fmus.driving.network.checkpoint import Checkpoint, read_network
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.fixed_point import rounded
from fmus.driving.network.keypoints import Keypoints
from fmus.driving.network.messages import to_message
from fmus.driving.network.point_transformer import recorded_points, weights_of
from fmus.driving.network.point_transformer_shapes import PREFIX, tensors
from fmus.driving.network.sensors import Sender, sensor_encoder
from fmus.driving.point_transformer import Crop, PointTransformerEncoder, encode, thin
from fmus.facilities import AlwaysOnFacilities
from fmus.messages.features import write_features
from fmus.messages.records import SENSOR_DATA
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array
from tests.fmus.driving.network.transformers import HEIGHT, architecture, cloud, network
from tests.fmus.facilities.world import SHARER, Run, objects_of


def numbers(keypoints: Keypoints) -> Array:
    return np.column_stack([keypoints.x, keypoints.y, keypoints.z, keypoints.features])


def points_of(scan: Cloud) -> Array:
    return np.stack([scan.x, scan.y, scan.z], axis=1)


@pytest.mark.parametrize("blocks", [2, 3])
def test_the_names_known_without_pytorch_are_those_of_pytorch(blocks: int) -> None:
    state = PointTransformerEncoder(blocks=blocks).state_dict()
    learned = {PREFIX + name: tuple(value.shape) for name, value in state.items() if value.dim()}
    assert tensors(blocks) == learned


@pytest.mark.parametrize(
    ("keypoints", "features", "points"), [(128, 128, 2048), (32, 256, 2048), (16, 128, 256)]
)
def test_an_architecture_says_how_many_points_a_scan_has(
    keypoints: int, features: int, points: int
) -> None:
    shape = architecture(keypoints, features)
    assert shape.points == points
    assert PointTransformerEncoder(blocks=shape.blocks).capacity(points) == keypoints


def test_a_checkpoint_encodes_as_the_network_that_was_stored(tmp_path: Path) -> None:
    """To the bit: float32 holds all that PyTorch computes with; and so does the library itself."""
    stored = network(seed=4)
    stored.write(tmp_path / "a.safetensors")
    read = read_network(str(tmp_path / "a.safetensors"))
    assert read.architecture == stored.architecture
    scan = cloud(200)  # all of them are read
    whole = numbers(sensor_encoder(stored).encode(scan))
    assert numbers(sensor_encoder(read).encode(scan)).tobytes() == whole.tobytes()
    direct = encode(
        PointTransformerEncoder(blocks=2, seed=4).eval(),
        torch.from_numpy(points_of(scan)),
        crop=Crop(),
        rng=np.random.default_rng(0),
        points=256,
    )
    assert np.array_equal(direct[:, :2], whole[:, :2])
    np.testing.assert_allclose(whole[:, 3:], direct[:, 3:], atol=0.51 / 256)


def test_keypoints_are_points_of_the_scan_over_the_ground_with_features_in_fixed_point() -> None:
    scan = cloud()
    found = sensor_encoder(network()).encode(scan)
    places = {tuple(point) for point in points_of(scan).tolist()}
    there = np.column_stack([found.x, found.y, found.z - HEIGHT]).tolist()
    assert len({tuple(point) for point in there} & places) == 16
    assert rounded(found.features).tobytes() == found.features.tobytes()
    assert np.ptp(found.features) > 0.1


def test_a_scan_is_encoded_the_same_whatever_came_before() -> None:
    """256 of 400 points are read, so chance has a say, and it is that of vehicle and time."""
    sensor = sensor_encoder(network())
    first = numbers(sensor.encode(cloud()))
    sensor.encode(cloud(seed=1, time=400_000_000))
    assert numbers(sensor.encode(cloud())).tobytes() == first.tobytes()
    assert numbers(sensor_encoder(network()).encode(cloud())).tobytes() == first.tobytes()
    later = numbers(sensor.encode(cloud(time=400_000_000)))
    other = numbers(sensor.encode(cloud(vehicle=8)))
    assert not np.array_equal(later, first)
    assert not np.array_equal(other, first)


def test_few_points_make_few_keypoints_and_none_make_none() -> None:
    sensor = sensor_encoder(network())
    assert sensor.encode(cloud(5)).features.shape == (5, 128)
    assert sensor.encode(cloud(0)).features.shape == (0, 128)


@pytest.mark.parametrize(
    ("keypoints", "features", "compression", "size"),
    [(128, 128, 16, 67_072), (32, 256, 32, 33_152)],
)
def test_messages_have_the_published_sizes_on_the_air(
    keypoints: int, features: int, compression: int, size: int
) -> None:
    """The packets of a scan through the facilities, few keypoints or many."""
    sender = Sender(network(architecture(keypoints, features)))
    parameters = AlwaysOnFacilities.Parameters(load="full", compression=compression)
    for points in (20, 3000):
        message = sender.message(cloud(points, vehicle=SHARER, time=5))
        assert message.size == size
        assert len(message.keypoints) == min(points, keypoints)
        packets = Run(AlwaysOnFacilities(parameters)).step(
            objects=objects_of(SHARER, 5), features=write_features([message])
        )
        data = packets[packets["kind"] == SENSOR_DATA]
        assert data["size"].sum() == size


def test_a_message_has_the_position_from_the_sensor() -> None:
    scan = cloud()
    found = sensor_encoder(network()).encode(scan)
    message = to_message(scan, found, architecture(), 0)
    np.testing.assert_allclose(message.keypoints[:, 2], found.z - HEIGHT, atol=1e-6)


def test_recorded_points_are_what_the_encoder_would_read() -> None:
    scan = cloud(500)
    recorded = recorded_points(scan, 2048)
    near = thin(torch.from_numpy(points_of(scan)), Crop()).numpy()
    assert recorded.dtype == np.int16
    assert np.array_equal(
        np.sort(recorded, axis=0), np.sort(np.rint(near * 100).astype(int), axis=0)
    )
    some = recorded_points(scan, 100)
    assert some.shape == (100, 3)
    assert {tuple(p) for p in some.tolist()} <= {tuple(p) for p in recorded.tolist()}


def broken(change: Callable[[dict[str, Any]], object]) -> Checkpoint:
    stored = network()
    weights = dict(stored.weights)
    change(weights)
    return dataclasses.replace(stored, weights=weights)


NAME = "encoder.point_transformer.down.0.network.1.running_var"


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda w: w.pop(NAME), f"`{NAME}` has the shape None, not (64,)"),
        (lambda w: w.update({NAME: np.ones(32)}), f"`{NAME}` has the shape (32,), not (64,)"),
        (
            lambda w: w.update({NAME: np.full(64, np.nan)}),
            f"`{NAME}` has numbers that are not finite",
        ),
        (lambda w: w.update({NAME: np.full(64, -1.0)}), f"`{NAME}` has variances below 0"),
        (lambda w: w.pop("head.second.bias"), "`head.second.bias` has the shape None, not (3,)"),
    ],
)
def test_checkpoints_that_are_not_whole_are_refused(
    change: Callable[[dict[str, Any]], object], problem: str, tmp_path: Path
) -> None:
    broken(change).write(tmp_path / "a.safetensors")
    with pytest.raises(ComponentTypeError, match=re.escape(problem)):
        read_network(str(tmp_path / "a.safetensors"))


@pytest.mark.parametrize(
    ("sizes", "problem"),
    [
        ({"features": 100}, "`features` are 100; they must be 128 or 256"),
        ({"keypoints": 8}, "`keypoints` are 8; they must be at least 16"),
        ({"vectors": 16}, "`vectors` are 16; they must be 0"),
        ({"early": True}, "`early` is true; others can only send keypoints"),
        ({"encoder": "pt"}, "`encoder` is `pt`; it must be `bev` or `point-transformer`"),
    ],
)
def test_architectures_that_there_are_not_are_refused(
    sizes: dict[str, Any], problem: str, tmp_path: Path
) -> None:
    good = {"keypoints": 16, "features": 128, "vectors": 0, "encoder": POINT_TRANSFORMER}
    with pytest.raises(ValueError, match=re.escape(problem)):
        Architecture(**{**good, **sizes})
    path = tmp_path / "a.safetensors"
    stored = network()
    for name, value in sizes.items():
        object.__setattr__(stored.architecture, name, value)  # frozen, and checked when made
    stored.write(path)
    with pytest.raises(
        ComponentTypeError, match="does not say its architecture: .*" + re.escape(problem)
    ):
        read_network(str(path))


def test_a_missing_pytorch_is_said_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`None` in `sys.modules` makes a module as good as not installed."""
    path = tmp_path / "a.safetensors"
    stored = network()
    stored.write(path)
    monkeypatch.setitem(sys.modules, "torch", None)
    hint = re.escape("run `pip install 'nlosim[torch]'`, or take a network with the encoder `bev`")
    with pytest.raises(ComponentTypeError, match=hint):
        FeatureEncoder(FeatureEncoder.Parameters(network=str(path)))
    with pytest.raises(ComponentTypeError, match=hint):
        sensor_encoder(stored)


def test_weights_of_an_encoder_are_all_but_the_counters() -> None:
    encoder = PointTransformerEncoder(blocks=3)
    assert weights_of(encoder).keys() == tensors(3).keys()
    assert sum(value.size for value in weights_of(encoder).values()) > 189_536
