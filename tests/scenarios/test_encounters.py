"""The encounters that ship besides the red light: what hides whom, and who collides."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import scenarios
from adapters.sumo.ego import stopping_distance
from adapters.sumo.entities import Dynamics
from tests.scenarios.encounter import EGO, SHARER, run

REACTION = 0.2
"""Of the rule-based policies [s]: the scan, and a second one that confirms the conflict."""
COMFORTABLE = 3.0
"""Deceleration with which the rule-based policies begin to brake [m/s^2]."""
SEEDS = range(1, 6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "own", "shared"),
    [("pedestrian", 9.6, 40.7), ("left_turn", 2.6, 24.1), ("platoon", 30.2, 96.8)],
)
def test_the_ego_sees_it_too_late_and_the_sharer_in_time(
    name: str, own: float, shared: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ways of the blind ego vehicle [m] from the first line of sight to where it collides."""
    blind = run(name, "policy-blind", 1, tmp_path / "run", capsys)
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
def test_only_the_blind_ego_collides(
    name: str, gap: float, seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same seed three times: only the policy differs. Others keep the gap [m]."""
    blind = run(name, "policy-blind", seed, tmp_path / "blind", capsys).metrics
    assert blind["collision"]
    assert blind["collision_partner"] == "collision vehicle"

    cooperative = run(name, "policy-rule-based", seed, tmp_path / "cooperative", capsys).metrics
    hidden = cooperative["hidden_vehicle"]
    assert hidden["first_seen_by"] == "sharing node"
    assert hidden["seen_by_ego"] - hidden["received_by_ego"] > 2.5
    assert cooperative["braking"]["time"] < hidden["seen_by_ego"] - 1.0
    expert = run(name, "policy-expert", seed, tmp_path / "expert", capsys).metrics
    for metrics in (cooperative, expert):
        assert metrics["success"]
        assert metrics["min_gap_m"] > gap


@pytest.mark.parametrize("name", ["pedestrian", "left_turn", "platoon"])
def test_the_net_is_what_netconvert_makes_of_its_sources(name: str, tmp_path: Path) -> None:
    beside_python = Path(sys.executable).with_name("netconvert")
    netconvert = beside_python if beside_python.exists() else shutil.which("netconvert")
    if netconvert is None:
        pytest.skip("netconvert is not installed (pip install nlosim[net])")
    assets = Path(scenarios.__file__).parent / "assets" / name
    for source in assets.iterdir():
        shutil.copy(source, tmp_path)
    subprocess.run([netconvert, "-c", f"{name}.netccfg"], cwd=tmp_path, check=True, timeout=60)
    made = (tmp_path / f"{name}.net.xml").read_text(encoding="utf-8")
    made = re.sub(r"^<!-- generated.*?^-->\n", "", made, flags=re.DOTALL | re.MULTILINE)
    assert made == (assets / f"{name}.net.xml").read_text(encoding="utf-8")
