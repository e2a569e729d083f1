"""A map of one's own is seldom along the axes: whoever turns it makes the same drive."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import scenarios
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario

SCENARIO = Path(scenarios.__file__).parent / "red_light.yaml"
MAP = SCENARIO.parent / "assets" / "red_light"


def turned(folder: Path, degrees: float) -> Path:
    """The red light's map with its buildings, about the middle of the crossing."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def place(x: str, y: str) -> tuple[float, float]:
        east, north = float(x), float(y)
        return cosine * east - sine * north, sine * east + cosine * north

    def shape(found: re.Match[str]) -> str:
        places = [place(*each.split(",")[:2]) for each in found[1].split()]
        return 'shape="' + " ".join(f"{x:.6f},{y:.6f}" for x, y in places) + '"'

    def junction(found: re.Match[str]) -> str:
        return ' x="{:.6f}" y="{:.6f}"'.format(*place(found[1], found[2]))

    for file in MAP.iterdir():
        text = file.read_text(encoding="utf-8")
        if file.name.endswith((".net.xml", ".poly.xml")):
            text = re.sub(r'\bshape="([^"]+)"', shape, text)
            text = re.sub(r' x="([^"]+)" y="([^"]+)"', junction, text)
        (folder / file.name).write_text(text, encoding="utf-8")
    return folder / "red_light.sumocfg"


def drive(folder: Path, degrees: float, *settings: str) -> Mapping[str, Any]:
    """How the rule-based policy drives with what is shared."""
    folder.mkdir()
    scene = turned(folder, degrees)
    values = [f"components.traffic.parameters.scene={scene}", "time.stop=24 s", "seed=101"]
    scenario = load_scenario(SCENARIO, (*values, *settings))
    return run_scenario(scenario, folder / "run", figure=False).metrics


def test_on_a_map_that_is_turned_one_drives_alike(tmp_path: Path) -> None:
    straight, askew = (drive(tmp_path / str(angle), angle) for angle in (0, 30))
    assert straight["success"]
    assert askew["success"]
    assert askew["completion_time"] == pytest.approx(straight["completion_time"], abs=0.5)


@pytest.mark.slow
def test_with_boxes_along_the_axes_one_does_not(tmp_path: Path) -> None:
    """Everybody in the next lane seems to be in one's own."""
    found = drive(tmp_path / "askew", 30, "components.perception.parameters.boxes=along_axes")
    assert not found["success"]
    assert found["min_speed"] == 0.0
