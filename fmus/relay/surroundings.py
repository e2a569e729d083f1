"""What stands between the radios, as far as the ego knows: bodies and walls."""

import numpy as np

from fmus.messages.apm import decode, read_header, split
from fmus.relay.crossings import Walls
from fmus.relay.inputs import Inputs
from fmus.relay.obstacles import (
    Obstacles,
    from_bsms,
    from_layer,
    from_node,
    from_objects,
    merge,
)
from fmus.relay.situation import Situation
from orchestrator.timebase import Duration, Time


class Surroundings:
    """The ego's mobility-and-height information (paper, "Relay Selection", steps 1 and 2).

    Args:
        same_body: distance at which two sources mean one obstacle [m].
        layer_lifetime: how long the layer of an APM counts after its scan [ns].
    """

    def __init__(self, same_body: float, layer_lifetime: Duration) -> None:
        self._same_body = same_body
        self._layer_lifetime = layer_lifetime
        self._apms: object = None
        self._messages: dict[int, tuple[Time, bytes]] = {}
        self._now: Time = 0
        self._walls = Walls(np.empty((0, 2)), np.empty(0, np.int32))
        self._map: object = None

    def remember(self, known: Inputs, now: Time) -> None:
        """Keep the APMs that the ego holds at `now` [ns]; they are read when they are needed."""
        self._now = now
        if known.apms is self._apms:
            return
        self._apms = known.apms
        for message in split(known.apms):
            header = read_header(message)
            self._messages[int(header["vehicle"])] = (int(header["time"]), message)

    def obstacles(self, situation: Situation) -> Obstacles:
        """All that is known, each body once, in order of trust.

        The ego's own body, the senders of BSMs, the sharer where it was last heard, the
        ego's lidar objects, and the layers of APMs.
        """
        ego, sharer = situation.ego, situation.sharer
        own = from_objects(situation.known.objects)
        heard = from_bsms(situation.known.bsms)
        silent = from_node(sharer).without(~np.isin([sharer.vehicle], heard.owner))
        margin = self._same_body
        bodies = [(source, margin) for source in (from_node(ego), heard, silent, own)]
        return merge([*bodies, *self._layers(ego.vehicle)])

    def walls(self, known: Inputs) -> Walls:
        """The walls on the ego's map, read once per map."""
        if self._map is not known.building_vertex:
            self._map = known.building_vertex
            self._walls = Walls(known.building_vertex, known.building_index)
        return self._walls

    def _layers(self, ego: int) -> list[tuple[Obstacles, float]]:
        oldest = self._now - self._layer_lifetime
        fresh = {v: kept for v, kept in self._messages.items() if kept[0] >= oldest}
        self._messages = fresh
        apms = [decode(message) for vehicle, (_, message) in fresh.items() if vehicle != ego]
        return [(from_layer(apm), apm.cell / 2.0) for apm in apms]
