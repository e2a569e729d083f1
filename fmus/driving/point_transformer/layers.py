"""The two layers of the encoder, on points with features and given neighbours."""

from typing import Final

from torch import Tensor, cat, nn
from typing_extensions import override

from fmus.driving.point_transformer.neighbours import gather

ATTENTION_WIDTH: Final = 32
"""Channels in which every block compares points, whatever the width of its features."""


class VectorAttention(nn.Module):
    r"""Vector self-attention (Zhao et al., Point Transformer, ICCV 2021, eq. (3)), residual.

    $$ y_i = \sum_{j} \rho(\gamma(\varphi(x_i) - \psi(x_j) + \delta)) \odot (\alpha(x_j) + \delta),
    \quad \delta = \theta(p_i - p_j) $$

    over the neighbours j of point i, with $\rho$ the softmax over j in each channel; a linear
    layer before and one behind it change the width (section 3.3).
    The last layer of $\gamma$ has no bias, which the softmax would cancel; nor has the last of
    all, which the batch normalisation behind it would (or a bias of whatever reads the features).

    Args:
        width: channels of the features.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        inner = ATTENTION_WIDTH
        self.into = nn.Linear(width, inner)
        self.query = nn.Linear(inner, inner, bias=False)
        self.key = nn.Linear(inner, inner, bias=False)
        self.value = nn.Linear(inner, inner, bias=False)
        self.position = nn.Sequential(nn.Linear(3, inner), nn.ReLU(), nn.Linear(inner, inner))
        self.weight = nn.Sequential(
            nn.Linear(inner, inner), nn.ReLU(), nn.Linear(inner, inner, bias=False)
        )
        self.out = nn.Linear(inner, width, bias=False)

    @override
    def forward(self, positions: Tensor, features: Tensor, neighbours: Tensor) -> Tensor:
        """New features of the points.

        Args:
            positions: [m], shape (cloud, point, 3).
            features: shape (cloud, point, width).
            neighbours: of each point, int64, shape (cloud, point, neighbour).

        Returns:
            Shape (cloud, point, width).
        """
        x = self.into(features)
        delta = self.position(positions[:, :, None] - gather(positions, neighbours))
        relation = self.query(x)[:, :, None] - gather(self.key(x), neighbours) + delta
        share = self.weight(relation).softmax(dim=2)
        attended = (share * (gather(self.value(x), neighbours) + delta)).sum(dim=2)
        result: Tensor = self.out(attended) + features
        return result


class TransitionDown(nn.Module):
    """Features of fewer points (Zhao et al. 2021, section 3.4; Qi et al., PointNet++, 2017).

    Each centre takes the largest value, by channel, of a shared network over the offsets and the
    features of its neighbours. The linear layers have no bias, which the batch normalisation
    would cancel.

    Args:
        width: channels of the features given.
        wider: channels of the features made.
    """

    def __init__(self, width: int, wider: int) -> None:
        super().__init__()
        self.network = nn.Sequential(
            nn.Linear(3 + width, wider, bias=False),
            nn.BatchNorm1d(wider),
            nn.ReLU(),
            nn.Linear(wider, wider, bias=False),
            nn.BatchNorm1d(wider),
            nn.ReLU(),
        )

    @override
    def forward(
        self, positions: Tensor, features: Tensor, centres: Tensor, neighbours: Tensor
    ) -> Tensor:
        """Features of the centres.

        Args:
            positions: [m], shape (cloud, point, 3).
            features: shape (cloud, point, width).
            centres: positions that keep features [m], shape (cloud, centre, 3).
            neighbours: of each centre among the points, int64, shape (cloud, centre, neighbour).

        Returns:
            Shape (cloud, centre, wider).
        """
        offset = gather(positions, neighbours) - centres[:, :, None]
        group = cat([offset, gather(features, neighbours)], dim=3)
        made: Tensor = self.network(group.flatten(0, 2))
        return made.view(*neighbours.shape, -1).amax(2)
