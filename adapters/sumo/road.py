"""The drivable surface: lanes of passenger cars with their widths, and junctions."""

from adapters.sumo.net import Net
from adapters.traffic.surroundings import RoadSurface, area, open_ring, strip


def read_road(net: Net) -> RoadSurface:
    """Lanes outside junctions that passenger cars may use, and the junctions at their ends.

    Ordered by name, lanes first. Lanes inside junctions are left out: they lie within the
    junction's own polygon.
    """
    lanes = [lane for lane in net.lanes() if net.allows(lane, "passenger")]
    junctions = {end for lane in lanes for end in net.ends_of(net.edge_of(lane))}
    strips = (strip(net.lane_shape(lane), net.lane_width(lane)) for lane in lanes)
    rings = [ring for ring in strips if len(ring)]
    for junction in sorted(junctions):
        ring = open_ring(net.junction_shape(junction))
        if area(ring) > 0.0:  # a dead end has none
            rings.append(ring)
    return RoadSurface.of(rings)
