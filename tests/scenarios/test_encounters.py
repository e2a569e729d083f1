"""The encounters that ship besides the red light: what hides whom, and who collides."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import scenarios
from adapters.sumo.ego import stopping_distance
from adapters.sumo.entities import Dynamics
from adapters.sumo.headless import with_stand_ins
from tests.scenarios.encounter import EGO, NO_MEASURES, SHARER, Run, run

REACTION = 0.2
"""Of the rule-based policies [s]: the scan, and a second one that confirms the conflict."""
COMFORTABLE = 3.0
"""Deceleration with which the rule-based policies begin to brake [m/s^2]."""
SEEDS = (1, 2)
"""Of the ten for which docs/encounters.md has the results."""

Runs = Callable[[str, str, int], Run]
"""Of a scenario, a policy and a seed."""


@pytest.fixture(scope="module")
def made() -> dict[tuple[str, str, int], Run]:
    """The runs that tests of this file share."""
    return {}


@pytest.fixture
def runs(
    made: dict[tuple[str, str, int], Run],
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
) -> Runs:
    """Make a run, or take it as another test has made it."""

    def made_once(name: str, policy: str, seed: int) -> Run:
        key = (name, policy, seed)
        if key not in made:
            out = tmp_path_factory.mktemp(name) / "run"
            made[key] = run(name, policy, seed, out, capsys, NO_MEASURES)
        return made[key]

    return made_once


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "own", "shared"),
    [
        ("pedestrian", 9.6, 40.7),
        ("left_turn", 2.6, 24.1),
        ("platoon", 30.2, 96.8),
        ("overtaking", 7.3, 51.4),
    ],
)
def test_the_ego_sees_it_too_late_and_the_sharer_in_time(
    name: str, own: float, shared: float, runs: Runs
) -> None:
    """Ways of the blind ego vehicle [m] from the first line of sight to where it collides."""
    blind = runs(name, "policy-blind", 1)
    rows = blind.before(blind.metrics["collision_time"])
    seen = next(row for row in rows if blind.sees(row, EGO, is_hidden_by_bodies=True))
    told = next(row for row in rows if blind.sees(row, SHARER, is_hidden_by_bodies=True))
    alone = next(row for row in rows if blind.sees(row, EGO, is_hidden_by_bodies=False))

    speed = blind.speed(seen)
    least = stopping_distance(speed, Dynamics().single_track) + REACTION * speed
    assert blind.way(seen, rows.stop) == pytest.approx(own, abs=0.5)
    assert blind.way(seen, rows.stop) < least
    assert blind.way(alone, rows.stop) > 1.2 * least

    assert blind.way(told, rows.stop) == pytest.approx(shared, abs=1.0)
    assert blind.way(told, rows.stop) > blind.speed(told) ** 2 / (2.0 * COMFORTABLE) + 2.0
    second = range(told, told + 20)
    assert all(blind.sees(row, SHARER, is_hidden_by_bodies=True) for row in second)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("name", "gap"), [("pedestrian", 1.0), ("left_turn", 2.0), ("platoon", 1.5)]
)
def test_only_the_blind_ego_collides(name: str, gap: float, seed: int, runs: Runs) -> None:
    """The same seed three times: only the policy differs. Others keep the gap [m]."""
    blind = runs(name, "policy-blind", seed).metrics
    assert blind["collision"]
    assert blind["collision_partner"] == "collision vehicle"

    cooperative = runs(name, "policy-rule-based", seed).metrics
    hidden = cooperative["hidden_vehicle"]
    assert hidden["first_seen_by"] == "sharing node"
    assert hidden["seen_by_ego"] - hidden["received_by_ego"] > 2.5
    assert cooperative["braking"]["time"] < hidden["seen_by_ego"] - 1.0
    expert = runs(name, "policy-expert", seed).metrics
    for metrics in (cooperative, expert):
        assert metrics["success"]
        assert metrics["min_gap_m"] > gap


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_only_the_blind_ego_overtakes_into_the_hidden_car(seed: int, runs: Runs) -> None:
    """Told 0.5 s after the start, before it would pull out; it stays, and passes afterwards."""
    blind = runs("overtaking", "policy-blind", seed)
    assert blind.metrics["collision_partner"] == "collision vehicle"
    assert blind.metrics["braking"]["seen_by"] == EGO
    until = blind.before(blind.metrics["collision_time"])
    assert blind.aside(until).max() > 3.3
    assert blind.speed(until[-1]) < blind.speed(until[0])

    for policy in ("policy-rule-based", "policy-expert"):
        other = runs("overtaking", policy, seed)
        assert other.metrics["success"]
        assert other.metrics["min_gap_m"] > 1.5
        aside = other.aside(range(len(other.times)))
        passing = int(np.argmax(aside > 0.2))
        assert other.times[passing] > other.metrics["min_gap_time"] > 6.0
        assert other.metrics["hidden_vehicle"]["received_by_ego"] < 0.5
        assert aside.max() == pytest.approx(3.5, abs=0.2)
        assert np.abs(aside[-20:]).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("gap", [40, 60, 80])
def test_who_comes_straight_on_is_seen_in_time_past_the_truck(
    gap: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a lidar of 120 m the ego sees it when it is a metre out, and drops back without V2X.

    The car comes at 50 km/h, from `gap` [m] beyond the junction.
    """
    collider = "components.traffic.parameters.entities.collider."
    blind = run(
        "overtaking",
        "policy-blind",
        1,
        tmp_path / "run",
        capsys,
        NO_MEASURES,
        f"{collider}position.lane=east_in_0",
        f"{collider}position.to_end={gap} m",
        f"{collider}speed=50 km/h",
        f"{collider}speed_profile=[{{time: 0 s, speed: 50 km/h}}]",
        "components.lidar.parameters.range=120 m",
    )
    assert blind.metrics["success"]
    assert blind.metrics["min_gap_m"] > 1.0
    meeting = blind.before(blind.metrics["min_gap_time"])
    assert 0.7 < blind.aside(meeting).max() < 2.5
    assert abs(blind.aside(meeting)[-1]) < 0.5


@pytest.mark.parametrize(
    "name", ["pedestrian", "left_turn", "platoon", "overtaking", "red_light_skewed"]
)
def test_the_net_is_what_netconvert_makes_of_its_sources(name: str, tmp_path: Path) -> None:
    beside_python = Path(sys.executable).with_name("netconvert")
    netconvert = beside_python if beside_python.exists() else shutil.which("netconvert")
    if netconvert is None:
        pytest.skip("netconvert is not installed (pip install nlosim[net])")
    assets = Path(scenarios.__file__).parent / "assets" / name
    here = tmp_path / name
    for folder in {assets, *_others(assets)}:
        shutil.copytree(folder, tmp_path / folder.name)
    environment = with_stand_ins(os.environ)
    command = [netconvert, "-c", f"{name}.netccfg"]
    subprocess.run(command, cwd=here, env=environment, check=True, timeout=60)
    made = (here / f"{name}.net.xml").read_text(encoding="utf-8")
    made = re.sub(r"^<!-- generated.*?^-->\n", "", made, flags=re.DOTALL | re.MULTILINE)
    assert made == (assets / f"{name}.net.xml").read_text(encoding="utf-8")


def _others(assets: Path) -> set[Path]:
    """The folders of other scenes whose files this one uses."""
    text = next(assets.glob("*.netccfg")).read_text(encoding="utf-8")
    return {assets.parent / name for name in re.findall(r"\.\./(\w+)/", text)}


def test_the_skewed_crossing_is_the_crossing_with_its_side_road_turned() -> None:
    """0.36 m north for every metre east, which is 19.8 degrees; lanes have the same names."""
    plain, skewed = (_lanes(name) for name in ("red_light", "red_light_skewed"))
    assert skewed.keys() == plain.keys()
    for name, lane in plain.items():
        before, after = (_angle(each) for each in (lane, skewed[name]))
        expected = 19.8 if name.startswith(("west", "east")) else 0.0
        assert (after - before + 180.0) % 360.0 - 180.0 == pytest.approx(expected, abs=0.1), name


def _lanes(scene: str) -> dict[str, np.ndarray]:
    """The shape of every lane outside the junction [m], shape (vertex, 2), by name."""
    path = Path(scenarios.__file__).parent / "assets" / scene / f"{scene}.net.xml"
    found = re.findall(r'<lane id="([a-z]\w*)".* shape="([^"]*)"', path.read_text(encoding="utf-8"))
    return {n: np.array([[*map(float, p.split(","))] for p in shape.split()]) for n, shape in found}


def _angle(lane: np.ndarray) -> float:
    """The direction of its last piece, from east [degrees]."""
    x, y = lane[-1] - lane[-2]
    return float(np.degrees(np.arctan2(y, x)))
