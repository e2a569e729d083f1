"""The encoder: its published shape, and what its result may depend on."""

import copy
import functools

import pytest
import torch
from torch import Tensor

from fmus.driving.point_transformer.encoder import Keypoints, PointTransformerEncoder
from fmus.driving.point_transformer.neighbours import gather, nearest
from fmus.driving.point_transformer.sampling import FirstPoints

from .clouds import cloud, shuffled

BOTH = pytest.mark.parametrize("blocks", [2, 3])


@functools.cache
def _used(blocks: int) -> PointTransformerEncoder:
    encoder = PointTransformerEncoder(blocks=blocks)
    for seed in range(10):
        encoder(cloud(seed=seed, clouds=2))
    return encoder.eval()


def used(blocks: int = 2) -> PointTransformerEncoder:
    """An encoder for inference whose batch statistics are those of clouds."""
    return copy.deepcopy(_used(blocks))


def encoded(encoder: PointTransformerEncoder, clouds: Tensor) -> Keypoints:
    with torch.inference_mode():
        found: Keypoints = encoder(clouds)
        return found


def by_position(found: Keypoints) -> dict[tuple[float, ...], Tensor]:
    return {
        tuple(p): f for p, f in zip(found.positions[0].tolist(), found.features[0], strict=True)
    }


@pytest.mark.parametrize(
    ("blocks", "keypoints", "dimensions", "size"), [(2, 128, 128, 67_072), (3, 32, 256, 33_152)]
)
def test_the_published_shape(blocks: int, keypoints: int, dimensions: int, size: int) -> None:
    encoder = used(blocks)
    found = encoded(encoder, cloud(clouds=2))
    assert found.positions.shape == (2, keypoints, 3)
    assert found.features.shape == (2, keypoints, dimensions)
    assert (encoder.capacity(), encoder.dimensions) == (keypoints, dimensions)
    numbers = torch.cat([found.positions, found.features], dim=2)[0].numpy()
    assert numbers.nbytes == encoder.message_size() == size


def test_the_levels_between_have_the_published_shapes() -> None:
    encoder, seen = used(3), []
    for layer in (encoder.embedding, *encoder.down, *encoder.attention):
        layer.register_forward_hook(lambda _, __, made: seen.append(tuple(made.shape[1:])))
    encoded(encoder, cloud())
    assert seen == [
        *[(2048, 32)] * 2,
        *[(512, 64)] * 2,
        *[(128, 128)] * 2,
        *[(32, 256)] * 2,
    ]


@pytest.mark.parametrize(
    ("blocks", "parameters", "published"), [(2, 66_688, 68_164), (3, 189_536, None)]
)
def test_numbers_of_weights(blocks: int, parameters: int, published: int | None) -> None:
    """Those of COOPERNAUT's backbone, less the biases that change nothing.

    They are in front of each batch normalisation (2 x 64 and 2 x 128), under each softmax
    (3 x 32), and at the end of each attention (32 + 64 + 128).
    """
    encoder = PointTransformerEncoder(blocks=blocks)
    assert sum(p.numel() for p in encoder.parameters()) == parameters
    if published is not None:
        stored = sum(v.numel() for v in encoder.state_dict().values())
        assert stored == published - (2 * 64 + 2 * 128 + 3 * 32 + 32 + 64 + 128)


@pytest.mark.slow
@BOTH
def test_the_order_of_the_points_does_not_matter(blocks: int) -> None:
    encoder, points = used(blocks), cloud()
    expected = encoded(encoder, points)
    found = encoded(encoder, shuffled(points)[0])
    assert torch.equal(found.positions, expected.positions)
    torch.testing.assert_close(found.features, expected.features, rtol=1e-5, atol=1e-5)


def test_features_depend_on_where_the_cloud_lies_but_keypoints_move_with_it() -> None:
    """The embedding reads positions; the layers behind it do not (see their test)."""
    encoder, points = used().double(), (cloud().double() * 64).round() / 64
    offset = torch.tensor([8.0, -4.0, 0.5], dtype=torch.float64)
    before, after = encoded(encoder, points), encoded(encoder, points + offset)
    assert torch.equal(after.positions, before.positions + offset)
    assert float((after.features - before.features).abs().max()) > 0.01


def test_features_depend_on_the_surroundings_of_a_keypoint_only() -> None:
    """A point moves at one end; features of keypoints far from it do not change."""
    encoder, points = used(), cloud()
    points = points[:, points[0, :, 0].argsort()]
    # outside of the sampling: an inner point close to another that is no keypoint
    distance = torch.cdist(points[0], points[0]).fill_diagonal_(torch.inf)
    mover = int(distance[:500].amin(1).argmin())
    changed = points.clone()
    changed[0, mover, 2] += 1e-3
    before, after = (by_position(encoded(encoder, p)) for p in (points, changed))
    far = [p for p in before if p in after and p[0] > 20.0]
    near = [p for p in before if p in after and torch.dist(torch.tensor(p), points[0, mover]) < 5]
    assert len(far) > 20
    assert near
    for place in far:
        assert torch.equal(after[place], before[place])
    assert any(not torch.equal(after[place], before[place]) for place in near)


@BOTH
@pytest.mark.parametrize("training", [True, False])
def test_every_weight_has_a_gradient(blocks: int, *, training: bool) -> None:
    encoder = used(blocks).train(training)
    found = encoder(cloud(clouds=2))
    direction = torch.randn(found.features.shape, generator=torch.Generator().manual_seed(2))
    (found.features * direction).sum().backward()
    scale = max(float(p.grad.abs().max()) for p in encoder.parameters() if p.grad is not None)
    for name, parameter in encoder.named_parameters():
        assert parameter.grad is not None, name
        # what is cancelled has rounding errors for a gradient, about 1e-7 of the largest
        assert float(parameter.grad.abs().max()) > 1e-5 * scale, name


def test_equal_seeds_make_equal_encoders_and_equal_results() -> None:
    torch.manual_seed(77)
    state = torch.get_rng_state()
    a, b, c = (PointTransformerEncoder(blocks=2, seed=s).eval() for s in (5, 5, 6))
    assert torch.equal(torch.get_rng_state(), state), "the state of PyTorch is left alone"
    points = cloud()
    assert torch.equal(encoded(a, points).features, encoded(b, points).features)
    assert torch.equal(encoded(a, points).features, encoded(a, points).features)
    assert not torch.equal(encoded(a, points).features, encoded(c, points).features)


@pytest.mark.slow
@BOTH
def test_a_batch_gives_what_its_clouds_give_alone(blocks: int) -> None:
    encoder, points = used(blocks), cloud(clouds=3)
    together = encoded(encoder, points)
    for c in range(3):
        alone = encoded(encoder, points[c : c + 1])
        assert torch.equal(together.positions[c], alone.positions[0])
        torch.testing.assert_close(together.features[c], alone.features[0], rtol=1e-5, atol=1e-5)


@BOTH
def test_single_precision_is_good_to_five_digits(blocks: int) -> None:
    encoder, points = used(blocks), cloud()
    single = encoded(encoder, points)
    double = encoded(encoder.double(), points.double())
    assert torch.equal(single.positions.double(), double.positions)
    error = (single.features.double() - double.features).abs().max()
    assert float(error) < 1e-5 * float(double.features.abs().max())


@BOTH
@pytest.mark.parametrize("points", [5, 40, 300, 1500])
def test_repeats_of_points_change_nothing(blocks: int, points: int) -> None:
    encoder, given = used(blocks), cloud(points)
    found = []
    for seed in (1, 2):
        generator = torch.Generator().manual_seed(seed)
        again = torch.randint(points, (2048 - points,), generator=generator)
        padded = torch.cat([shuffled(given, seed=seed)[0], given[:, again]], dim=1)
        with torch.inference_mode():
            found.append(encoder(padded, torch.tensor([points])))
    count = min(points, encoder.capacity())
    a, b = found
    assert torch.equal(a.positions[:, :count], b.positions[:, :count])
    torch.testing.assert_close(a.features[:, :count], b.features[:, :count], rtol=1e-5, atol=1e-5)
    places = {tuple(p) for p in a.positions[0].tolist()}
    assert len(places) == count
    assert places <= {tuple(p) for p in given[0].tolist()}


def test_counting_all_points_as_distinct_is_the_default() -> None:
    encoder, points = used(), cloud()
    with torch.inference_mode():
        counted = encoder(points, torch.tensor([2048]))
    assert torch.equal(counted.features, encoded(encoder, points).features)


def test_sampling_once_and_reusing_neighbours_is_what_the_levels_would_do_themselves() -> None:
    encoder, points = used(), cloud()
    positions, features = points, encoder.embedding(points)
    features = encoder.attention[0](positions, features, nearest(positions, positions, 16))
    for down, attention in zip(encoder.down, encoder.attention[1:], strict=True):
        centres = gather(positions, encoder.sampling.choose(positions, positions.shape[1] // 4))
        features = down(positions, features, centres, nearest(centres, positions, 16))
        positions = centres
        features = attention(positions, features, nearest(positions, positions, 16))
    found, expected = encoder(points), Keypoints(positions=positions, features=features)
    a, b = by_position(found), by_position(expected)
    assert a.keys() == b.keys()
    for place, feature in a.items():
        torch.testing.assert_close(feature, b[place], rtol=1e-5, atol=1e-5)


def test_random_keypoints_are_the_first_points() -> None:
    encoder = PointTransformerEncoder(blocks=2, sampling=FirstPoints()).eval()
    points = cloud()
    assert torch.equal(encoded(encoder, points).positions, points[:, :128])


def test_fewer_points_suit_if_enough_are_left_for_the_last_level() -> None:
    encoder = PointTransformerEncoder(blocks=2).eval()
    assert encoded(encoder, cloud(512)).positions.shape == (1, 32, 3)
    assert encoder.capacity(512) == 32


@pytest.mark.slow
@BOTH
def test_nothing_is_computed_beside_the_device(blocks: int) -> None:
    """PyTorch refuses to mix tensors of this device, which has shapes only, with others."""
    encoder = PointTransformerEncoder(blocks=blocks).to("meta")
    found = encoder(cloud(clouds=2).to("meta"))
    assert found.features.is_meta
    assert found.positions.is_meta
    assert found.features.shape == (2, encoder.capacity(), encoder.dimensions)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
@BOTH
def test_a_gpu_gives_what_the_cpu_gives(blocks: int) -> None:
    encoder, points = used(blocks), cloud(clouds=2)
    here = encoded(encoder, points)
    there = encoded(encoder.to("cuda"), points.to("cuda"))
    assert torch.equal(there.positions.cpu(), here.positions)
    torch.testing.assert_close(there.features.cpu(), here.features, rtol=1e-3, atol=1e-3)


def test_another_number_of_blocks_is_refused() -> None:
    with pytest.raises(ValueError, match=r"blocks is 4; it must be 2 .* or 3"):
        PointTransformerEncoder(blocks=4)


@pytest.mark.parametrize(
    ("clouds", "message"),
    [
        (torch.zeros(2048, 3), r"shape \(2048, 3\) are no batch"),
        (torch.zeros(1, 2048, 4), "give x, y and z"),
        (torch.zeros(0, 2048, 3), "are no batch"),
        (torch.zeros(1, 2008, 3), "clouds of 2008 points cannot be down-sampled 2 times"),
        (torch.zeros(1, 128, 3), "to a multiple of 16, at least 256"),
    ],
)
def test_clouds_that_do_not_suit_are_refused(clouds: Tensor, message: str) -> None:
    encoder = PointTransformerEncoder(blocks=2).eval()
    with pytest.raises(ValueError, match=message):
        encoder(clouds)


def test_numbers_of_distinct_points_for_other_clouds_are_refused() -> None:
    with pytest.raises(ValueError, match=r"distinct has the shape \(2,\); .* of 3 clouds"):
        PointTransformerEncoder()(cloud(clouds=3), torch.tensor([2048, 2048]))
