"""The raster hits what brute force hits, at the same distance."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, assume, given, settings, strategies as st

from fmus.messages.bodies import Body
from fmus.messages.records import BUILDING
from tests.fmus.scene import SIZES, Building, Scene, Vehicle

from .brute_force import NOTHING, Float, cast, rotation
from .harness import NO_NOISE, Scan

Int = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]
TOLERANCE = 1e-4  # of distances [m]
GRAZING_ANGLE = 1e-9  # [rad]: 0.05 micrometres at 50 m
GRAZING_LEAP = 1e-3  # [m]
SHAPES = (
    ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    ((-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)),  # L
    ((-1, -1), (1, -1), (1, 1), (0.6, 1), (0.6, -0.5), (-0.6, -0.5), (-0.6, 1), (-1, 1)),  # U
    tuple((math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8)),
    ((-1, -1), (0.2, -0.1), (1, -1), (0.1, 0.2), (0, 1), (-0.1, 0.2)),  # a star
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern:
    """The scan pattern and the tilt of the sensor; angles in rad."""

    channels: int = 64
    azimuths: int = 256
    top: float = math.radians(4)
    bottom: float = math.radians(-20)
    pitch: float = 0.0
    roll: float = 0.0
    reach: float = 60.0

    def parameters(self) -> dict[str, float]:
        """The FMU's parameters."""
        return NO_NOISE | {
            "channels": self.channels,
            "azimuths": self.azimuths,
            "elevation_top": self.top,
            "elevation_bottom": self.bottom,
            "pitch": self.pitch,
            "roll": self.roll,
            "range": self.reach,
        }

    @property
    def rays(self) -> int:
        """How many there are."""
        return self.channels * self.azimuths

    def directions(self) -> Float:
        """Unit vectors in the sensor frame, by azimuth, then channel; shape (rays, 3)."""
        azimuth = np.arange(self.azimuths)[:, None] * (2 * np.pi / self.azimuths)
        elevation = np.linspace(self.top, self.bottom, self.channels)[None, :]
        x, y = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
        z = np.broadcast_to(np.sin(elevation), x.shape)
        return np.stack([x, y, z], axis=-1).reshape(-1, 3)

    def ray_of(self, points: Float) -> npt.NDArray[np.int64]:
        """Number of the ray through each point, (n, 3) in the sensor frame; shape (n,)."""
        r = np.linalg.norm(points, axis=1)
        turn = np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi)
        azimuth = np.round(turn * self.azimuths).astype(np.int64) % self.azimuths
        step = (self.bottom - self.top) / max(self.channels - 1, 1)
        channel = np.round((np.arcsin(points[:, 2] / r) - self.top) / (step or 1.0))
        ray: npt.NDArray[np.int64] = azimuth * self.channels + channel.astype(np.int64)
        return ray


Case = tuple[Pattern, int, int, list[float]]  # with vehicles, buildings, heights of these [m]


def town(rng: np.random.Generator, vehicles: int, buildings: int, heights: Float) -> Scene:
    """A random scene within 80 m; the vehicle in the middle carries the sensor.

    Bodies and buildings may overlap, but no two faces coincide: which of them a ray hits first
    would be undefined.
    """
    cars = []
    for k in range(vehicles):
        body = Body(int(rng.integers(len(Body))))
        length, width, height = SIZES[body]
        position = rng.uniform(-50, 50, 2) if k else np.zeros(2)
        ground = float(rng.choice([0.0, 0.0, 0.0, 0.7, 5.0])) if k else 0.0
        cars.append(
            Vehicle(
                id=10 * k + int(rng.integers(10)),
                position=(float(position[0]), float(position[1]), ground),
                heading=float(rng.uniform(-7, 7)),
                size=(
                    length,
                    width * float(rng.uniform(0.9, 1.1)),
                    height * float(rng.uniform(0.9, 1.1)),
                ),
                body=body,
                lidar=k == 0,
            )
        )
    houses = []
    for _ in range(buildings):
        angle, turn = rng.uniform(0, 2 * np.pi, 2)
        center = rng.uniform(8, 70) * np.array([np.cos(angle), np.sin(angle)])
        shape = np.array(SHAPES[rng.integers(len(SHAPES))]) * rng.uniform(3, 15, 2)
        ring = shape @ rotation(turn, 0, 0)[:2, :2].T + center
        ring = ring[:: rng.choice([-1, 1])]
        corners = tuple((float(x), float(y)) for x, y in ring)
        houses.append(
            Building(ring=corners, height=float(rng.choice(heights) * rng.uniform(0.9, 1.1)))
        )
    return Scene(vehicles=cars, buildings=houses)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What the FMU and brute force say of the same rays; each member has one element per ray.

    Attributes:
        instance, expected: what was hit, or `NOTHING`.
        distance_error: [m]; 0 where nothing was hit or the instances differ.
        wrong: the rays about which they disagree.
        grazing: those of them which, turned by `GRAZING_ANGLE`, hit something else, or are more
            than `GRAZING_LEAP` longer or shorter.
    """

    instance: Int
    expected: Int
    distance_error: Float
    wrong: Bool
    grazing: Bool


def compare(scan: Scan, scene: Scene, pattern: Pattern, sides: int = 4) -> Comparison:
    """Scan a scene with one sensor, and cast the same rays by brute force.

    Args:
        scan: with the FMU.
        scene: what there is.
        pattern: the rays.
        sides: to how many each ray is turned, to see whether it grazes something.
    """
    ((own, cloud),) = scan(scene, **pattern.parameters()).items()
    turn = rotation(float(cloud.sensor["heading"]), pattern.pitch, pattern.roll)
    world, origin = pattern.directions() @ turn.T, cloud.sensor["position"]
    expected_distance, expected = cast(scene, own, origin, world, pattern.reach)
    points = cloud.points["position"].astype(float)
    ray = pattern.ray_of(points)
    assert (np.diff(ray) > 0).all(), "points are in the order of azimuth, then channel"
    distance, instance = np.full(pattern.rays, np.inf), np.full(pattern.rays, NOTHING)
    distance[ray], instance[ray] = np.linalg.norm(points, axis=1), cloud.points["instance"]
    both = np.isfinite(distance) & np.isfinite(expected_distance)
    error = np.zeros(pattern.rays)
    error[both] = np.abs(distance[both] - expected_distance[both])
    wrong = (instance != expected) | (error > TOLERANCE)
    grazing = np.zeros(pattern.rays, np.bool_)
    for turned in turned_a_little(world[wrong], sides):
        found, name = cast(scene, own, origin, turned, pattern.reach)
        with np.errstate(invalid="ignore"):  # infinity - infinity
            leap = np.nan_to_num(np.abs(found - expected_distance[wrong]), nan=0.0)
        grazing[wrong] |= (name != expected[wrong]) | (leap > GRAZING_LEAP)
    return Comparison(instance, expected, error, wrong, grazing)


def turned_a_little(direction: Float, sides: int) -> list[Float]:
    """Unit vectors turned by `GRAZING_ANGLE` to all sides, each of shape (rays, 3)."""
    aside = np.cross(direction, [0.6, -0.64, 0.48])  # a direction that no ray has
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    up = np.cross(direction, aside)
    angles = 0.3 + 2 * np.pi * np.arange(sides) / sides
    return [direction + GRAZING_ANGLE * (np.cos(a) * aside + np.sin(a) * up) for a in angles]


LEVEL = [
    (Pattern(), 40, 12, [12.0, 25.0]),
    (Pattern(), 120, 20, [1.0, 3.0, 12.0]),
    (Pattern(), 0, 30, [0.5, 1.0, 1.5]),
    (Pattern(top=1.2, bottom=-1.2, reach=45.0), 60, 10, [2.0, 20.0]),
    (Pattern(top=0.3, bottom=-0.5, reach=200.0), 30, 40, [3.0, 40.0]),
    (Pattern(reach=100.0), 150, 20, [1.5, 15.0]),
    (Pattern(top=1.5, bottom=-1.5), 100, 10, [1.0, 5.0]),
]
TILTED = [
    (Pattern(pitch=0.05), 60, 12, [1.5, 15.0]),
    (Pattern(pitch=-0.1, roll=0.2), 60, 12, [1.5, 15.0]),
    (Pattern(top=1.3, bottom=-1.3, pitch=1.0, roll=-0.7), 80, 10, [1.0, 8.0]),
    (Pattern(top=0.3, bottom=-1.5, roll=1e-3, reach=100.0), 150, 20, [1.0, 20.0]),
    (Pattern(top=1.5, bottom=-1.5, pitch=math.pi / 2), 100, 20, [1.0, 10.0]),
    (Pattern(top=1.4, bottom=-0.2, roll=math.pi), 100, 20, [1.0, 10.0]),
    (Pattern(top=1.5, bottom=-1.5, pitch=-math.pi / 2, roll=2.0), 0, 30, [0.5, 1.0, 40.0]),
]


@pytest.mark.slow
@pytest.mark.parametrize("cases", [LEVEL, TILTED], ids=["level", "tilted"])
def test_every_ray_hits_what_brute_force_hits(scan: Scan, cases: list[Case]) -> None:
    """More than 100,000 rays each; a ray at an edge may go either way, if there are few of them."""
    rays = grazing = 0
    for number, (pattern, vehicles, buildings, heights) in enumerate(cases):
        rng = np.random.default_rng(number)
        scene = town(rng, max(vehicles, 1), buildings, np.array(heights))
        found = compare(scan, scene, pattern)
        wrong = np.flatnonzero(found.wrong & ~found.grazing)
        assert len(wrong) == 0, f"case {number}, rays {wrong[:9]}"
        rays += pattern.rays
        grazing += int(found.grazing.sum())
        assert (found.instance <= BUILDING).sum() > 100, "the scene is worth testing"
        assert (found.instance >= 0).sum() > (20 if vehicles else -1)
    assert rays > 100_000
    assert grazing < 1e-5 * rays


@st.composite
def patterns(draw: st.DrawFn) -> Pattern:
    """Any that the FMU accepts, with few rays."""
    channels = draw(st.integers(1, 20))
    top = draw(st.floats(-1.5, 1.5))
    bottom = max(top - draw(st.floats(1e-9, 3.0)), -1.5)
    assume(bottom < top)
    quarter = math.pi / 2
    return Pattern(
        channels=channels,
        azimuths=draw(st.integers(4, 70)),
        top=top,
        bottom=bottom,
        pitch=draw(st.floats(-quarter, quarter) | st.sampled_from([0.0, quarter])),
        roll=draw(st.floats(-math.pi, math.pi) | st.sampled_from([0.0, math.pi, -quarter])),
        reach=draw(st.floats(10.0, 100.0)),
    )


@given(pattern=patterns(), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_pattern_is_exact(scan: Scan, pattern: Pattern, seed: int) -> None:
    """Few azimuths, channels close together or far apart, the sensor's axis anywhere."""
    rng = np.random.default_rng(seed)
    scene = town(rng, 12, 8, np.array([0.5, 1.5, 10.0]))
    ((own, cloud),) = scan(scene, **pattern.parameters()).items()
    turn = rotation(float(cloud.sensor["heading"]), pattern.pitch, pattern.roll)
    world, origin = pattern.directions() @ turn.T, cloud.sensor["position"]
    distance, instance = cast(scene, own, origin, world, pattern.reach)
    hit = np.isfinite(distance)
    # the rays that hit something are in the same order as the points
    expected = np.where(hit, distance, 0.0)[hit, None] * pattern.directions()[hit]
    assert len(cloud.points) == hit.sum()
    assert (cloud.points["instance"] == instance[hit]).all()
    np.testing.assert_allclose(cloud.points["position"], expected, rtol=0, atol=TOLERANCE)


_WHOLE = st.integers(-6, 6)
Ring = list[tuple[int, int]]


def has_strip_without_area(ring: Ring) -> bool:
    """Whether two edges lie one on the other, at least in part."""
    edges = [(a, b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True) if a != b]
    return any(lie_on_each_other(*e, *f) for e, f in itertools.combinations(edges, 2))


def lie_on_each_other(*corners: tuple[int, int]) -> bool:
    """Whether the edges from the first to the second and from the third to the fourth do."""
    (ax, ay), (bx, by), *others = corners
    x, y = bx - ax, by - ay
    if any(x * (py - ay) != y * (px - ax) for px, py in others):
        return False
    low, high = sorted((px - ax) * x + (py - ay) * y for px, py in others)
    return low < x * x + y * y and high > 0


@pytest.mark.slow
@given(
    ring=st.lists(st.tuples(_WHOLE, _WHOLE), min_size=3, max_size=7),
    height=st.sampled_from([1.0, 2.0, 3.0]),
    quarters=st.tuples(st.integers(0, 3), st.integers(-1, 1), st.integers(-2, 2)),
)
@settings(max_examples=300, deadline=None)
def test_degenerate_rings_in_line_with_the_rays_are_exact(
    scan: Scan, ring: Ring, height: float, quarters: tuple[int, int, int]
) -> None:
    """Edges that cross, of no length, through the sensor's axis; a roof at its height.

    The rays at edges are many here; all others are right.
    """
    assume(not has_strip_without_area(ring))  # rays along it may hit it or miss it
    heading, pitch, roll = (math.pi / 2 * quarter for quarter in quarters)
    ego = Vehicle(id=1, heading=heading, lidar=True)
    house = Building(ring=[(float(x), float(y)) for x, y in ring], height=height)
    scene = Scene(vehicles=[ego], buildings=[house])
    pattern = Pattern(channels=9, azimuths=16, top=1.2, bottom=-1.2, pitch=pitch, roll=roll)
    found = compare(scan, scene, pattern, sides=24)
    wrong = np.flatnonzero(found.wrong & ~found.grazing)
    assert len(wrong) == 0, f"rays {wrong[:9]}"
