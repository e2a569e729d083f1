"""Expected PRR of the direct link and of all relays over a time to come."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fmus.relay.bystanders import Bystanders
from fmus.relay.crossings import Hops, Walls, crossings
from fmus.relay.knife_edges import shadowing
from fmus.relay.measured import MeasuredLinks
from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles
from fmus.relay.prediction import Horizon
from fmus.relay.radio import Radio
from fmus.relay.situation import Situation
from orchestrator.signal import Array

_OBSTRUCTED = 6.0
"""Loss by bodies from which on a hop counts as obstructed [dB]: a roof at the straight line."""
_APM_FIRST = 0.8
"""Probability that of two overlapping frames the other's comes first, if it is four times as
long: a fragment of 1100 bytes, and 200 bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Losses:
    """What else costs power, or packets; named as the parameters of the policy.

    Attributes:
        wall_loss: per building wall [dB].
        indoor_loss: inside buildings [dB/m].
        bsm_overlap: probability that a BSM of one neighbour overlaps with a packet, where
            the two senders do not hear each other.
        apm_overlap: the same of the ego's own APM.
        hidden: probability that a body that obstructs a hop hides one more.
        hidden_body: what that one costs [dB].
        contention: share of packets over a relay that are lost because the sharer sends
            while the relay forwards.
    """

    wall_loss: float
    indoor_loss: float
    bsm_overlap: float
    apm_overlap: float
    hidden: float
    hidden_body: float
    contention: float


class Expectation:
    """The expected PRR.

    Args:
        radio: of all nodes.
        losses: beside free space, bodies and noise.
        horizon: the instants looked at; the first is now.
        correction_time: with which the difference between a measured power and the one
            computed for now decays [s].
        at_once: candidates for which the effect of bystanders is computed together.
    """

    def __init__(
        self,
        radio: Radio,
        losses: Losses,
        horizon: Horizon,
        correction_time: float,
        at_once: int = 8,
    ) -> None:
        self._radio = radio
        self._losses = losses
        self._horizon = horizon
        self._at_once = at_once
        self._fade = np.exp(-horizon.time / correction_time)[:, None]

    def of_routes(self, situation: Situation, obstacles: Obstacles, walls: Walls) -> Array:
        """The expected PRR of the direct link, then of each candidate, shape (1 + candidate,)."""
        ego, sharer = situation.ego, situation.sharer
        nodes = list(situation.candidates.values())
        links = situation.known.links
        hops = self._hops(ego, sharer, nodes, situation.known.route)
        center = self._horizon.straight(obstacles.center, obstacles.velocity)
        power, free = self._powers(hops, obstacles, walls, center)
        power = self._corrected(power, hops, links)[1:]
        hidden = self._losses.hidden * (free[1:] - power > _OBSTRUCTED)
        success = self._or_hidden(self._noise_spares, power, hidden)
        last = len(nodes) + 1
        direct, first, second = power[:, :1], power[:, 1:last], power[:, last:]
        apm = self._losses.apm_overlap
        unheard = self._or_hidden(self._radio.unheard, direct, hidden[:, :1])
        spoiled = self._radio.overlapped(first, second, _APM_FIRST)
        relayed = success[:, 1:last] * success[:, last:]
        relayed *= 1.0 - apm * unheard * spoiled
        relayed *= 1.0 - apm * self._radio.unheard(first)
        relayed *= 1.0 - apm * self._radio.unheard(second)
        relayed *= 1.0 - self._losses.contention
        routes = np.concatenate([success[:, :1], relayed], axis=1).mean(axis=0)
        bystanders = Bystanders(self._radio, situation)
        order = np.argsort(-routes[1:], kind="stable")
        is_current = np.array([v == situation.current for v in situation.candidates], bool)[order]
        order = np.concatenate([order[is_current], order[~is_current]])
        return self._spared(routes, order, power.mean(axis=0), bystanders, walls)

    def _spared(
        self,
        routes: Array,
        order: Array,
        power: Array,
        bystanders: Bystanders,
        walls: Walls,
    ) -> Array:
        """`routes` times the probability that no BSM of a bystander spoils a packet.

        Factors are computed where they may decide: in the given order, until no route that
        is left would be better than the best even without them. Those keep the smallest
        factor found.

        Args:
            routes: expected PRR without bystanders, (1 + candidate,).
            order: of candidates: the current choice, then by falling PRR, (candidate,).
            power: mean powers [dBm], (hop,).
            bystanders: the other neighbours.
            walls: of buildings; bodies between bystanders and candidates are left out.
        """
        count = len(routes) - 1
        overlap = self._losses.bsm_overlap
        value = routes.copy()
        value[0] *= np.exp(-overlap * bystanders.of_direct(power[0]))
        best, least = value[0], 1.0
        done = 0
        while done < count and (done == 0 or routes[1 + order[done]] > best):
            some = order[done : done + self._at_once]
            between = self._without_bodies(bystanders.hops(some), walls)
            spoilt = bystanders.of_relays(some, power[1 + some], power[1 + count + some], between)
            factor = np.exp(-overlap * spoilt)
            value[1 + some] *= factor
            best, least = max(best, float(value[1 + some].max())), min(least, float(factor.min()))
            done += len(some)
        value[1 + order[done:]] *= least
        return value

    def _noise_spares(self, power: Array) -> Array:
        return self._radio.success(power - self._radio.noise_floor)

    def _or_hidden(
        self, probability: Callable[[Array], Array], power: Array, hidden: Array
    ) -> Array:
        """A probability that depends on the power, where one more body may stand in the way.

        What obstructs a hop hides what stands behind it from the sensors.

        Args:
            probability: of the power [dBm].
            power: without that body [dBm], (instant, hop).
            hidden: probability of that body, of the same shape.
        """
        with_body = probability(power - self._losses.hidden_body)
        return np.asarray((1.0 - hidden) * probability(power) + hidden * with_body)

    def _powers(
        self, hops: Hops, obstacles: Obstacles, walls: Walls, center: Array
    ) -> tuple[Array, Array]:
        """Received powers as computed, and without bodies [dBm], (instant, hop) each."""
        found = crossings(hops, obstacles, center)
        ends = (hops.start.reshape(-1, 3), hops.end.reshape(-1, 3))
        bodies = shadowing(found, *ends, obstacles.height, self._radio.wavelength)
        free = self._without_bodies(hops, walls)
        return np.asarray(free - bodies.reshape(free.shape)), free

    def _without_bodies(self, hops: Hops, walls: Walls) -> Array:
        """Received powers, with buildings alone in the way [dBm], (..., hop)."""
        length = np.linalg.norm(hops.end - hops.start, axis=-1)
        cuts, inside = walls.cuts(hops.start[..., :2], hops.end[..., :2])
        lost = self._losses.wall_loss * cuts + self._losses.indoor_loss * inside * length
        return np.asarray(self._radio.free_space(length) - lost)

    def _hops(self, ego: Node, sharer: Node, nodes: list[Node], route: Array) -> Hops:
        """The direct link, from the sharer to each candidate, and from each to the ego."""
        antennas = self._horizon.antennas([sharer, ego, *nodes])
        antennas[:, 1, :2] = self._horizon.along(ego, route)
        count = len(nodes)
        relays = np.arange(count) + 2
        start = np.concatenate([[0], np.zeros(count, np.int64), relays])
        end = np.concatenate([[1], relays, np.ones(count, np.int64)])
        ids = np.array([node.vehicle for node in (sharer, ego, *nodes)], np.int64)
        return Hops(
            vehicle=np.stack([ids[start], ids[end]], axis=1),
            start=antennas[:, start],
            end=antennas[:, end],
        )

    def _corrected(self, power: Array, hops: Hops, links: MeasuredLinks) -> Array:
        """`power`, less what was measured to be missing; the less so the later.

        Obstacles that the ego does not know only take away, so a power that was measured
        stronger than computed changes nothing: the measurement lags. A radio that reports the
        sharer's power only where it heard it has not heard it where it reports none: the power
        is then at most the sensitivity.
        """
        transmitter, receiver = hops.vehicle[:, 0], hops.vehicle[:, 1]
        measured = links.power(transmitter, receiver)
        silent = np.isnan(measured) & links.is_reported(transmitter)
        measured[silent] = np.minimum(power[0, silent], self._radio.sensitivity)
        missing = np.fmin(measured - power[0], 0.0)
        return np.asarray(power + self._fade * missing)
