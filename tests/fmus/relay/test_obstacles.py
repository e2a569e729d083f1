"""What the ego knows to stand in the way: merged from three sources, searched hop by hop."""

import numpy as np
from hypothesis import given, strategies as st

from fmus.messages.records import APM_LAYER_CELL, NO_VEHICLE, OBJECT
from fmus.relay.crossings import Hops, crossings
from fmus.relay.obstacles import Obstacles, from_layer, from_objects, merge
from tests.fmus.messages.apm.apms import apm_of
from tests.fmus.relay.world import SHARER


def test_the_sub_matrix_of_two_nodes_holds_every_cell_that_can_obstruct_them() -> None:
    """Step 3 searches the box that the two nodes span; what lies outside is never crossed."""
    rng = np.random.default_rng(1)
    count = 400
    cells = Obstacles(
        owner=np.full(count, NO_VEHICLE),
        center=rng.uniform(-50, 50, (count, 2)),
        heading=np.zeros(count),
        half=np.full((count, 2), 1.25),
        height=np.full(count, 4.0),
        velocity=np.zeros((count, 2)),
    )
    for start, end in rng.uniform(-40, 40, (50, 2, 3)):
        hop = Hops(vehicle=np.array([[1, 2]]), start=start[None], end=end[None])
        low, high = np.minimum(start, end)[:2] - 1.25, np.maximum(start, end)[:2] + 1.25
        spanned = np.flatnonzero(((cells.center > low) & (cells.center < high)).all(axis=1))
        assert set(crossings(hop, cells).obstacle) <= set(spanned)


def test_a_body_over_which_a_hop_begins_or_ends_is_crossed_and_one_behind_the_end_is_not() -> None:
    """A hop of 100 m to the east; bodies of 10 m x 2 m, that of the antenna itself left out."""
    middles = [-6.0, -4.0, 50.0, 104.0, 106.0]
    cells = Obstacles(
        owner=np.array([3, 4, 5, 6, 7]),
        center=np.array([[x, 0.5] for x in middles]),
        heading=np.zeros(5),
        half=np.tile([5.0, 1.0], (5, 1)),
        height=np.full(5, 4.0),
        velocity=np.zeros((5, 2)),
    )
    ends = np.array([[0.0, 0.0, 1.5]]), np.array([[100.0, 0.0, 1.5]])
    found = crossings(Hops(vehicle=np.array([[1, 2]]), start=ends[0], end=ends[1]), cells)
    assert found.obstacle.tolist() == [1, 2, 3]
    assert found.middle.tolist() == [0.005, 0.5, 0.995]  # of the part that is over the body
    found = crossings(Hops(vehicle=np.array([[4, 2]]), start=ends[0], end=ends[1]), cells)
    assert found.obstacle.tolist() == [2, 3]


def body(center: tuple[float, float], half: tuple[float, float]) -> Obstacles:
    """A standing vehicle, 1.5 m high."""
    return Obstacles(
        owner=np.array([9]),
        center=np.array([center]),
        heading=np.zeros(1),
        half=np.array([half]),
        height=np.array([1.5]),
        velocity=np.zeros((1, 2)),
    )


def layer_cell(x: float, y: float, height: float) -> Obstacles:
    """The obstacle that an APM of 5 m cells reports for whatever stands at (x, y)."""
    layer = np.zeros((20, 20), APM_LAYER_CELL)
    apm = apm_of(vehicle=SHARER, layer=layer)
    row, column = apm.locate(np.array([x, y]))
    layer["height"][row, column] = round(height / 0.05)
    return from_layer(apm)


@given(st.floats(-40, 40), st.floats(-40, 40))
def test_a_known_body_explains_the_cell_it_stands_in_but_not_a_higher_one(
    x: float, y: float
) -> None:
    """Wherever in the cell it stands; a phantom beside it would obstruct free links."""
    known = body(center=(x, y), half=(2.25, 0.9))
    seen, truck_beside = layer_cell(x, y, 1.5), layer_cell(x, y, 4.0)
    assert len(merge([(known, 1.0), (seen, 2.5)]).owner) == 1
    assert len(merge([(known, 1.0), (truck_beside, 2.5)]).owner) == 2


def test_one_body_known_from_two_sources_counts_once() -> None:
    box = body(center=(5.0, 5.0), half=(2.0, 1.0))
    assert len(merge([(box, 1.0), (box, 1.0)]).owner) == 1
    assert len(from_layer(apm_of()).owner) == 0


def test_an_object_stands_where_its_box_does() -> None:
    """Middle, angle, and half of each side; nobody's by name."""
    seen = np.zeros(1, OBJECT)
    seen["position"], seen["angle"], seen["size"] = (12.0, -3.0), 0.4, (5.0, 1.8)
    seen["height"], seen["velocity"] = 2.5, (3.0, -1.0)
    found = from_objects(seen)
    assert (found.owner.tolist(), found.heading.tolist()) == ([NO_VEHICLE], [0.4])
    assert (found.center.tolist(), found.half.tolist()) == ([[12.0, -3.0]], [[2.5, 0.9]])
    assert (found.height.tolist(), found.velocity.tolist()) == ([2.5], [[3.0, -1.0]])
