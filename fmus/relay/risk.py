"""The NLOS risk of a link: shadowing by obstacles, weighted by how long it will last."""

from dataclasses import dataclass

import numpy as np

from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles
from orchestrator.signal import Array

SPEED_OF_LIGHT = 299_792_458.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskModel:
    """Parameters of the risk.

    Attributes:
        wavelength: [m].
        minimum_speed_difference: bounds 1/|dv| of the paper's Eq. (3) from above, which is
            infinite for equal velocities [m/s].
        wall_loss: per building wall [dB] (the paper: 9.6 dB).
        itu: whether Eq. (1) has the factor 2 of ITU-R P.526-15, equation (26).
    """

    wavelength: float
    minimum_speed_difference: float
    wall_loss: float
    itu: bool

    def of_link(
        self, first: Node, second: Node, reference: Node, obstacles: Obstacles, walls: Array
    ) -> float:
        r"""The paper's Eq. (4) for one hop: sum of L_v-shadow times S over the obstacles.

        $$ V = \sum_i L_i S_i, \quad S_i = 1/|v_1 - v_i| + 1/|v_2 - v_i| $$

        Building walls are obstacles at rest with `wall_loss` each; the ego knows them from
        its map (paper, section "Obstacle Shadowing").

        Args:
            first: one end of the hop.
            second: the other end.
            reference: the node whose velocity stands beside the node's own in S; the ego
                for a hop that ends at it, else the other end of the hop.
            obstacles: all known obstacles; the bodies of the two ends are passed over.
            walls: ends of building walls [m], shape (wall, 2, 2).
        """
        others = obstacles.without(
            (obstacles.owner != first.vehicle) & (obstacles.owner != second.vehicle)
        )
        crosses, fraction = others.crossing(first.position, second.position)
        loss = self._knife_edge(first, second, others.height, fraction)
        similar = self._similarity(first, reference, others.velocity)
        risk = float(np.sum(np.where(crosses, loss * similar, 0.0)))
        cuts = _cuts(first.position, second.position, walls)
        if cuts:
            still = float(self._similarity(first, reference, np.zeros((1, 2)))[0])
            risk += cuts * self.wall_loss * still
        return risk

    def _knife_edge(self, first: Node, second: Node, height: Array, fraction: Array) -> Array:
        r"""L_v-shadow [dB] of each obstacle, 0 where it stays below the line of sight.

        $$ \nu = h \sqrt{(1/\lambda)(1/d_1 + 1/d_2)}, \quad
           L = 6.9 + 20 \log_{10}(\sqrt{(\nu - 0.1)^2 + 1} + \nu - 0.1) $$

        (paper, Eqs. (1) and (2); ITU-R P.526-15, equations (26) and (31), with 2/lambda.)
        """
        distance = max(float(np.linalg.norm(second.position - first.position)), 1e-3)
        inner = np.clip(fraction, 1e-3, 1.0 - 1e-3)
        line = first.antenna_height + (second.antenna_height - first.antenna_height) * inner
        above = height - line
        factor = 2.0 if self.itu else 1.0
        spread = 1.0 / (inner * distance) + 1.0 / ((1.0 - inner) * distance)
        nu = above * np.sqrt(factor / self.wavelength * spread)
        loss = 6.9 + 20.0 * np.log10(np.sqrt((nu - 0.1) ** 2 + 1.0) + nu - 0.1)
        return np.where(above > 0.0, loss, 0.0)

    def _similarity(self, node: Node, reference: Node, velocity: Array) -> Array:
        """S of the paper's Eq. (3) [s/m]."""
        slowest = self.minimum_speed_difference
        own = np.maximum(np.linalg.norm(node.velocity - velocity, axis=-1), slowest)
        other = np.maximum(np.linalg.norm(reference.velocity - velocity, axis=-1), slowest)
        return np.asarray(1.0 / own + 1.0 / other)


def _cuts(start: Array, end: Array, walls: Array) -> int:
    """How many walls the segment crosses."""
    if len(walls) == 0:
        return 0
    along = end - start
    edge = walls[:, 1] - walls[:, 0]
    offset = walls[:, 0] - start
    cross = along[0] * edge[:, 1] - along[1] * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        on_link = (offset[:, 0] * edge[:, 1] - offset[:, 1] * edge[:, 0]) / cross
        on_wall = (offset[:, 0] * along[1] - offset[:, 1] * along[0]) / cross
    hit = (cross != 0) & (on_link > 0) & (on_link < 1) & (on_wall >= 0) & (on_wall < 1)
    return int(np.count_nonzero(hit))
