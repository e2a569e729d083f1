"""The NLOS risk of hops: shadowing by obstacles, weighted by how long it will last."""

from dataclasses import dataclass

import numpy as np

from fmus.physics.propagation import knife_edge_loss
from fmus.relay.crossings import Hops, Walls, crossings
from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Ahead:
    """Where everybody is predicted to be.

    Attributes:
        hops: of shape (instant, hop).
        center: of the obstacles [m], shape (instant, obstacle, 2).
    """

    hops: Hops
    center: Array


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

    def of_hops(
        self,
        pairs: list[tuple[Node, Node]],
        references: list[Node],
        obstacles: Obstacles,
        walls: Walls,
        ahead: Ahead | None = None,
    ) -> Array:
        r"""The paper's Eq. (4) for each hop: sum of L_v-shadow times S over the obstacles.

        $$ V = \sum_i L_i S_i, \quad S_i = 1/|v_1 - v_i| + 1/|v_2 - v_i| $$

        Building walls are obstacles at rest with `wall_loss` each; the ego knows them from
        its map (paper, section "Obstacle Shadowing").

        Args:
            pairs: both ends of each hop.
            references: for each hop the node whose velocity v_2 stands beside that of the
                pair's first, v_1.
            obstacles: all known obstacles; the bodies of the two ends are passed over.
            walls: of the buildings.
            ahead: where all will be; the risk is then the mean over these instants, with the
                velocities of now. `None`: the risk of now.

        Returns:
            [dB s/m], shape (hop,).
        """
        hops = Hops.between(pairs) if ahead is None else ahead.hops
        found = crossings(hops, obstacles, None if ahead is None else ahead.center)
        v = np.array([[p[0].velocity, r.velocity] for p, r in zip(pairs, references, strict=True)])
        hop = found.hop % len(pairs)
        loss = self._knife_edge(hops, found.hop, obstacles.height[found.obstacle], found.middle)
        similar = self._similarity(v[hop], obstacles.velocity[found.obstacle])
        cuts, _ = walls.cuts(hops.start[..., :2], hops.end[..., :2])
        risk = np.bincount(found.hop, loss * similar, minlength=cuts.size).reshape(cuts.shape)
        still = self._similarity(v, np.zeros((len(pairs), 2)))
        risks = risk + cuts * self.wall_loss * still
        return np.asarray(risks if ahead is None else risks.mean(axis=0))

    def _knife_edge(self, hops: Hops, hop: Array, height: Array, middle: Array) -> Array:
        r"""L_v-shadow [dB] of each crossing, 0 where it stays below the line of sight.

        $$ \nu = h \sqrt{(1/\lambda)(1/d_1 + 1/d_2)}, \quad
           L = 6.9 + 20 \log_{10}(\sqrt{(\nu - 0.1)^2 + 1} + \nu - 0.1) $$

        (paper, Eqs. (1) and (2); ITU-R P.526-15, equations (26) and (31), with 2/lambda.)
        """
        first, last = hops.start.reshape(-1, 3)[hop], hops.end.reshape(-1, 3)[hop]
        distance = np.maximum(np.linalg.norm((last - first)[:, :2], axis=-1), 1e-3)
        inner = np.clip(middle, 1e-3, 1.0 - 1e-3)
        above = height - (first[:, 2] + (last - first)[:, 2] * inner)
        factor = 2.0 if self.itu else 1.0
        spread = 1.0 / (inner * distance) + 1.0 / ((1.0 - inner) * distance)
        nu = above * np.sqrt(factor / self.wavelength * spread)
        return np.where(above > 0.0, knife_edge_loss(nu), 0.0)

    def _similarity(self, ends: Array, obstacle: Array) -> Array:
        """S of the paper's Eq. (3) [s/m].

        Args:
            ends: velocities of the two nodes [m/s], (n, 2, 2).
            obstacle: velocities [m/s], (n, 2).
        """
        apart = np.linalg.norm(ends - obstacle[:, None], axis=-1)
        bounded: Array = 1.0 / np.maximum(apart, self.minimum_speed_difference)
        return np.asarray(bounded[:, 0] + bounded[:, 1])
