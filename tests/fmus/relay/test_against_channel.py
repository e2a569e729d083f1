"""What expected PRR computes is what the channel FMU does, on scenes that stand still."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from fmus.messages.records import NO_VEHICLE
from fmus.physics.error_rate import frame_success
from fmus.physics.propagation import wavelength
from fmus.relay.crossings import Hops, Walls, crossings
from fmus.relay.knife_edges import shadowing
from fmus.relay.obstacles import Obstacles
from orchestrator.signal import Array
from tests.fmus.channel.harness import Channel
from tests.fmus.driver import Library
from tests.fmus.relay.world import radio
from tests.fmus.scene import Building, Scene, Vehicle

WAVELENGTH = wavelength(5.9e9)
RADIO = radio()
OUTPUTS = ("path_loss", "vehicle_loss", "building_loss", "header_success", "payload_success")
LINKS = 50
SCENES = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])

SEEDS = st.integers(0, 2**32 - 1)
"""Of random scenes: in general position, where no line grazes a corner."""


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library.build("channel", tmp_path_factory.mktemp("channel"))


def probed(library: Library, scene: Scene, start: Array, end: Array) -> dict[str, Array]:
    with Channel(library, scene) as channel:
        channel.resize(n_probe=len(start))
        channel.set("probe.transmitter", start)
        channel.set("probe.receiver", end)
        channel.set("probe.carrier", np.full((len(start), 2), -1, np.int64))
        channel.set("probe.size", np.full(len(start), 200, np.uint32))
        channel.step(0.0, 0.1, [])
        return {name: channel.get(f"probe.{name}", len(start)) for name in OUTPUTS}


def hops(start: Array, end: Array) -> Hops:
    return Hops(vehicle=np.full((len(start), 2), -2), start=start, end=end)


def obstacles(vehicles: Sequence[Vehicle]) -> Obstacles:
    return Obstacles(
        owner=np.full(len(vehicles), NO_VEHICLE),
        center=np.array([v.position[:2] for v in vehicles]).reshape(-1, 2),
        heading=np.array([v.heading for v in vehicles], float),
        half=np.array([v.size[:2] for v in vehicles]).reshape(-1, 2) / 2.0,
        height=np.array([v.size[2] for v in vehicles], float),
        velocity=np.zeros((len(vehicles), 2)),
    )


def antennas(rng: np.random.Generator, count: int) -> Array:
    return rng.uniform((-80.0, -80.0, 1.4), (80.0, 80.0, 6.0), (count, 3))


def ring(rng: np.random.Generator) -> Array:
    """A turned rectangle; its corners run one way or the other."""
    turn, (a, b) = rng.uniform(0, 6.3), rng.uniform(5, 40, 2)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    corners = np.array([(-a, -b), (a, -b), (a, b), (-a, b)]) / 2.0
    turned: Array = corners[:: int(rng.choice((1, -1)))] @ axes
    return np.asarray(rng.uniform(-60, 60, 2) + turned)


def outside(points: Array, rings: list[Array]) -> Array:
    """Which points are in none of these convex rings."""
    free = np.ones(len(points), bool)
    for corners in rings:
        edge = np.roll(corners, -1, axis=0) - corners
        offset = points[:, None, :2] - corners
        side = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0] > 0
        free &= ~(side.all(axis=1) | ~side.any(axis=1))
    return free


@given(SEEDS)
@SCENES
def test_bodies_cost_what_they_cost_in_the_channel(library: Library, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vehicles = [
        Vehicle(
            id=k,
            position=(float(x), float(y), 0.0),
            heading=float(rng.uniform(0, 6.3)),
            size=(float(rng.uniform(3, 18)), float(rng.uniform(1, 3)), float(rng.uniform(1, 5))),
            equipped=False,
        )
        for k, (x, y) in enumerate(rng.uniform(-60, 60, (int(rng.integers(60)), 2)))
    ]
    start, end = antennas(rng, LINKS), antennas(rng, LINKS)
    known = obstacles(vehicles)
    found = crossings(hops(start, end), known)
    ours = shadowing(found, start, end, known.height, WAVELENGTH)
    theirs = probed(library, Scene(vehicles=vehicles), start, end)
    np.testing.assert_allclose(ours, theirs["vehicle_loss"], atol=1e-6)
    length = np.linalg.norm(end - start, axis=1)
    np.testing.assert_allclose(26.0 - RADIO.free_space(length), theirs["path_loss"], atol=1e-6)


@given(SEEDS)
@SCENES
def test_buildings_cost_what_they_cost_in_the_channel(library: Library, seed: int) -> None:
    """Whichever way their corners run; antennas are below the roofs, and outside."""
    rng = np.random.default_rng(seed)
    rings = [ring(rng) for _ in range(int(rng.integers(1, 6)))]
    buildings = [Building(ring=[(x, y) for x, y in corners], height=30.0) for corners in rings]
    start, end = antennas(rng, LINKS), antennas(rng, LINKS)
    free = outside(start, rings) & outside(end, rings)
    start, end = start[free], end[free]
    walls = Walls(np.concatenate(rings), np.repeat(np.arange(len(rings)), 4))
    count, inside = walls.cuts(start[:, :2], end[:, :2])
    length = np.linalg.norm(end - start, axis=1)
    theirs = probed(library, Scene(buildings=buildings), start, end)
    ours = 9.0 * count + 0.4 * inside * length
    np.testing.assert_allclose(ours, theirs["building_loss"], atol=1e-6)


def test_noise_spares_as_many_frames_as_in_the_channel(library: Library) -> None:
    """From none to all, on links of 1.2 to 5 km: SNIR 8 to 3 dB, the band edges 0.007 dB lower."""
    distance = np.linspace(1800.0, 5000.0, 60)
    end = np.stack([distance, np.zeros(60), np.full(60, 1.5)], axis=1)
    start = np.tile([0.0, 0.0, 1.5], (60, 1))
    theirs = probed(library, Scene(), start, end)
    snr = RADIO.free_space(distance) - RADIO.noise_floor
    both = theirs["header_success"] * theirs["payload_success"]
    assert both.min() < 1e-3
    assert both.max() > 1 - 1e-3
    exact = [frame_success(float(value), 238) for value in snr]
    np.testing.assert_allclose(exact, both, atol=5e-3)
    np.testing.assert_allclose(RADIO.success(snr), exact, atol=5e-3)
