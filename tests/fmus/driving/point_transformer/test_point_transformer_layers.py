"""The layers, from their equations."""

import torch
from torch import Tensor, nn

from fmus.driving.point_transformer.layers import TransitionDown, VectorAttention
from fmus.driving.point_transformer.neighbours import gather, nearest

from .clouds import cloud


def attention(width: int, seed: int = 0) -> VectorAttention:
    torch.manual_seed(seed)
    return VectorAttention(width).double().eval()


def transition(width: int, wider: int) -> TransitionDown:
    """With batch statistics that are not those of a new one."""
    torch.manual_seed(0)
    layer = TransitionDown(width, wider).double()
    layer.network(torch.randn(1000, 3 + width, dtype=torch.float64) * 3 + 1)
    return layer.eval()


def random_features(points: int, width: int) -> Tensor:
    generator = torch.Generator().manual_seed(4)
    return torch.randn(1, points, width, dtype=torch.float64, generator=generator)


def test_attention_is_equation_3_of_the_point_transformer() -> None:
    layer, positions, features = attention(64), cloud(40).double(), random_features(40, 64)
    neighbours = nearest(positions, positions, 5)
    found = layer(positions, features, neighbours)
    x = features[0] @ layer.into.weight.T + layer.into.bias
    for i in range(40):
        logits, values = [], []
        for j in neighbours[0, i].tolist():
            delta = layer.position(positions[0, i] - positions[0, j])
            phi, psi = layer.query.weight @ x[i], layer.key.weight @ x[j]
            logits.append(layer.weight(phi - psi + delta))
            values.append(layer.value.weight @ x[j] + delta)
        share = torch.stack(logits).exp()
        share = share / share.sum(0)
        y = (share * torch.stack(values)).sum(0)
        expected = layer.out.weight @ y + features[0, i]
        torch.testing.assert_close(found[0, i], expected, rtol=1e-10, atol=1e-10)


def test_attention_to_oneself_alone_shares_nothing() -> None:
    """One neighbour, itself: the weights are 1, so queries and keys have no say."""
    layer, positions, features = attention(32), cloud(20).double(), random_features(20, 32)
    alone = torch.arange(20)[None, :, None]
    before = layer(positions, features, alone)
    for part in (layer.query, layer.key):
        nn.init.normal_(part.weight)
    assert torch.equal(layer(positions, features, alone), before)


def test_a_transition_down_is_the_largest_value_over_the_neighbours() -> None:
    layer, positions, features = transition(8, 16), cloud(40).double(), random_features(40, 8)
    centres = positions[:, :10]
    neighbours = nearest(centres, positions, 6)
    found = layer(positions, features, centres, neighbours)
    for i in range(10):
        rows = [
            torch.cat([positions[0, j] - centres[0, i], features[0, j]])
            for j in neighbours[0, i].tolist()
        ]
        for linear, norm in ((0, 1), (3, 4)):
            batch = layer.network[norm]
            assert isinstance(batch, nn.BatchNorm1d)
            assert batch.running_mean is not None
            assert batch.running_var is not None
            rows = [
                (
                    (layer.network[linear](row) - batch.running_mean)
                    / (batch.running_var + batch.eps).sqrt()
                    * batch.weight
                    + batch.bias
                ).clamp(min=0.0)
                for row in rows
            ]
        torch.testing.assert_close(found[0, i], torch.stack(rows).amax(0), rtol=1e-10, atol=1e-10)


def test_both_layers_read_differences_of_positions_only() -> None:
    # multiples of 1/64 m: translation by a multiple changes no bit of a difference
    positions = (cloud(60).double() * 64).round() / 64
    moved = positions + torch.tensor([17.0, -4.5, 1.25], dtype=torch.float64)
    features, neighbours = random_features(60, 32), nearest(positions, positions, 16)
    attend, down = attention(32), transition(32, 64)
    assert torch.equal(attend(moved, features, neighbours), attend(positions, features, neighbours))
    assert torch.equal(
        down(moved, features, moved[:, :15], neighbours[:, :15]),
        down(positions, features, positions[:, :15], neighbours[:, :15]),
    )


def test_neither_depends_on_the_order_of_points_or_neighbours() -> None:
    positions, features = cloud(60).double(), random_features(60, 32)
    neighbours = nearest(positions, positions, 16)
    generator = torch.Generator().manual_seed(9)
    order = torch.randperm(60, generator=generator)[None]
    where = order.argsort(1)[0]  # new index of each old point
    among = torch.randperm(16, generator=generator)
    moved, there = gather(positions, order), gather(features, order)
    new = where[neighbours[:, order[0]]][:, :, among]
    attend, down = attention(32), transition(32, 64)
    torch.testing.assert_close(
        attend(moved, there, new), gather(attend(positions, features, neighbours), order)
    )
    torch.testing.assert_close(
        down(moved, there, moved, new),
        gather(down(positions, features, positions, neighbours), order),
    )


def test_repeated_neighbours_do_not_change_a_transition_down() -> None:
    positions, features = cloud(60).double(), random_features(60, 32)
    neighbours = nearest(positions, positions, 8)
    down = transition(32, 64)
    twice = torch.cat([neighbours, neighbours[:, :, :4]], dim=2)
    torch.testing.assert_close(
        down(positions, features, positions, twice),
        down(positions, features, positions, neighbours),
        rtol=1e-12,
        atol=1e-12,
    )


def test_gradients_are_those_of_finite_differences() -> None:
    positions = cloud(12).double().requires_grad_()
    features = random_features(12, 8).requires_grad_()
    neighbours = nearest(positions, positions, 4)
    attend, down = attention(8), transition(8, 16)

    def both(positions: Tensor, features: Tensor) -> Tensor:
        features = attend(positions, features, neighbours)
        made: Tensor = down(positions, features, positions[:, :3], neighbours[:, :3])
        return made

    assert torch.autograd.gradcheck(both, (positions, features))
