"""From a scan to the bytes of a message."""

import itertools

import numpy as np
import pytest
import torch

from fmus.driving.point_transformer.cloud import Crop
from fmus.driving.point_transformer.encoder import PointTransformerEncoder
from fmus.driving.point_transformer.message import encode, to_message
from fmus.messages.features import read_features, write_features

from .clouds import cloud, shuffled

CROP = Crop()


def generator() -> np.random.Generator:
    return np.random.default_rng(4)


@pytest.mark.parametrize(("blocks", "size"), [(2, 67_072), (3, 33_152)])
def test_a_message_has_the_published_size_and_survives_the_signal(blocks: int, size: int) -> None:
    encoder = PointTransformerEncoder(blocks=blocks).eval()
    keypoints = encode(encoder, cloud(20_000)[0], crop=CROP, rng=generator())
    message = to_message(
        encoder, keypoints, vehicle=7, time=300, position=np.array([1.0, 2.0, 3.0]), heading=0.5
    )
    assert message.size == message.keypoints.nbytes == encoder.message_size() == size
    (again,) = read_features(write_features([message]))
    assert (again.vehicle, again.time, again.heading) == (7, 300, 0.5)
    assert again.position.tolist() == [1.0, 2.0, 3.0]
    assert np.array_equal(again.keypoints, keypoints)


def test_keypoints_are_points_of_the_scan_in_the_order_of_the_sampling() -> None:
    encoder, scan = PointTransformerEncoder().eval(), cloud(20_000)[0]
    keypoints = encode(encoder, scan, crop=CROP, rng=generator())
    place = torch.from_numpy(keypoints[:, :3])
    assert {tuple(p) for p in place.tolist()} <= {tuple(p) for p in scan.tolist()}
    gaps = [float(torch.cdist(place[n : n + 1], place[:n]).min()) for n in range(1, 128)]
    assert all(a >= b * (1 - 1e-6) for a, b in itertools.pairwise(gaps))


def test_the_order_of_the_scan_does_not_matter_to_any_bit_but_the_generator_does() -> None:
    encoder, scan = PointTransformerEncoder().eval(), cloud(20_000)[0]
    found = encode(encoder, scan, crop=CROP, rng=generator())
    assert np.array_equal(encode(encoder, shuffled(scan)[0], crop=CROP, rng=generator()), found)
    other = encode(encoder, scan, crop=CROP, rng=np.random.default_rng(5))
    assert not np.array_equal(other, found)


@pytest.mark.parametrize("points", [0, 1, 5, 100])
def test_a_scan_of_few_points_has_as_many_keypoints(points: int) -> None:
    encoder = PointTransformerEncoder().eval()
    scan = cloud(points)[0]
    keypoints = encode(encoder, scan, crop=CROP, rng=generator())
    assert keypoints.shape == (points, 131)
    assert keypoints.dtype == np.float32
    assert np.isfinite(keypoints).all()
    assert {tuple(k) for k in keypoints[:, :3].tolist()} == {tuple(p) for p in scan.tolist()}
    message = to_message(encoder, keypoints, vehicle=1, time=0, position=np.zeros(3), heading=0.0)
    assert message.size == 67_072, "padded on the air"
    assert len(read_features(write_features([message]))[0].keypoints) == points


def test_without_too_many_points_the_generator_has_no_say() -> None:
    encoder, scan = PointTransformerEncoder().eval(), cloud(1500)[0]
    a, b = (encode(encoder, scan, crop=CROP, rng=np.random.default_rng(seed)) for seed in (1, 2))
    assert np.array_equal(a[:, :3], b[:, :3])
    np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5)


def test_an_encoder_in_training_mode_is_refused() -> None:
    with pytest.raises(ValueError, match="the encoder is in training mode; call its `eval`"):
        encode(PointTransformerEncoder(), cloud()[0], crop=CROP, rng=generator())
