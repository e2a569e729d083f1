"""The model of the ways that values may take between hosts."""

import multiprocessing

import pytest

from benchmarks.distributed.ring import PARALLEL, SEQUENTIAL, Ring
from benchmarks.distributed.ways import FAR, PLACES, WAYS, Plan, Way, measure

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="hosts of the model are forked"
)

DELAY = 0.02

IN_TURN = Way(is_direct=False, ahead=0)
DIRECT = Way(is_direct=True, ahead=1)


def plan(algorithm: str, members: int, way: Way) -> Plan:
    return Plan(ring=Ring(4096, algorithm, members), place=PLACES[members], way=way)


@pytest.mark.parametrize("algorithm", [PARALLEL, SEQUENTIAL])
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_all_ways_give_the_same(algorithm: str, way: Way) -> None:
    """`measure` compares every element with what it must be."""
    times, _ = measure(plan(algorithm, 5, way), 0.0, FAR + 3)
    assert len(times) == FAR + 2


@pytest.mark.parametrize(
    ("algorithm", "members", "way", "delays"),
    [
        (PARALLEL, 3, IN_TURN, 2),
        (PARALLEL, 3, DIRECT, 2),
        (SEQUENTIAL, 3, IN_TURN, 4),
        (SEQUENTIAL, 3, DIRECT, 3),
        (SEQUENTIAL, 5, IN_TURN, 8),
        (SEQUENTIAL, 5, Way(is_direct=False, ahead=1), 4),
    ],
)
def test_a_step_takes_the_delays_of_its_way(
    algorithm: str, members: int, way: Way, delays: int
) -> None:
    times, _ = measure(plan(algorithm, members, way), DELAY, 4)
    assert min(times) > delays * DELAY


def test_what_goes_direct_does_not_go_to_a_host_from_the_run() -> None:
    """Of three outputs that are read elsewhere, one is made on a host and read on another."""
    steps, size = 10, 4096
    _, through = measure(plan(PARALLEL, 3, IN_TURN), 0.0, steps)
    _, beside = measure(plan(PARALLEL, 3, DIRECT), 0.0, steps)
    saved = (through - beside) / steps / size
    assert saved == pytest.approx(1.0, abs=0.1)
