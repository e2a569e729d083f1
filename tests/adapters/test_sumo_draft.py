"""A scenario drafted for a foreign scene is sound, and says what it takes for granted."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from adapters.sumo.draft import Draft, draft
from adapters.sumo.files import read_scene
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.units import format_duration
from orchestrator.timebase import nanoseconds
from tests.adapters.sumo_runs import scene

MS = 1_000_000
NONE, WITHIN = "sets no end", "ends within its first step"


def drafted(folder: Path, config: Path) -> tuple[Draft, Scenario]:
    """A draft beside other files of `folder`, and what the scenario loader makes of it."""
    files, problems = read_scene(config)
    assert not problems
    made = draft(files, folder)
    path = folder / "drafted.yaml"
    path.write_text(made.text, encoding="utf-8")
    return made, load_scenario(path)


@dataclass(frozen=True)
class Times:
    """What the configuration says, times [s] and steps [ns] of the scenario, and why it ends."""

    said: str
    start: str
    stop: str
    traffic: int = 100 * MS
    radio: int = 10 * MS
    ending: str = ""


@pytest.mark.parametrize(
    "times",
    [
        Times("", "0", "60", ending=NONE),
        Times('<end value="-1"/>', "0", "60", ending=NONE),
        Times('<begin value="16:00:00"/>', "57600", "57660", ending=NONE),
        Times('<begin value="5"/><end value="7.25"/>', "5", "7.2"),
        Times('<begin value="5.05"/><end value="7.05"/>', "5.05", "7.05"),
        Times('<begin value="5"/><end value="5.1"/>', "5", "5.1"),
        Times('<begin value="5"/><end value="5.04"/>', "5", "65", ending=WITHIN),
        Times('<begin value="5"/><end value="4"/>', "5", "65", ending=WITHIN),
        Times('<step-length value="10"/><end value="9"/>', "0", "60", 10_000 * MS, ending=WITHIN),
        Times('<step-length value="1"/><end value="9.5"/>', "0", "9", 1000 * MS),
        Times('<step-length value="0.7"/>', "0", "59.5", 700 * MS, ending=NONE),
        Times('<step-length value="0.015"/><end value="0.1"/>', "0", "0.09", 15 * MS),
        Times('<step-length value="0.005"/>', "0", "60", 5 * MS, 5 * MS, ending=NONE),
    ],
    ids=lambda times: times.said,
)
def test_times_and_steps_are_those_of_the_scene(tmp_path: Path, times: Times) -> None:
    """Without an end a minute, without a step 100 ms; all steps divide the time, which is some."""
    made, scenario = drafted(tmp_path, scene(tmp_path, options=times.said))
    assert (scenario.start, scenario.stop) == (nanoseconds(times.start), nanoseconds(times.stop))
    steps = {name: use.step for name, use in scenario.components.items()}
    assert steps == {"traffic": times.traffic, "facilities": times.radio, "channel": times.radio}
    assert scenario.components["traffic"].values["step_length"] == times.traffic / 1e9
    step_is_said = made.assumptions[0].startswith("SUMO's step is that of the scene")
    assert step_is_said == ("step-length" in times.said)
    takes = f"the run takes {format_duration(scenario.stop - scenario.start)}"
    of_the_scene = "time is that of the scene, from its begin to its end"
    assert made.assumptions[1] == (
        f"the scene {times.ending}: {takes}" if times.ending else of_the_scene
    )


def test_everybody_with_an_engine_has_a_radio_and_their_bsms_go_over_the_channel(
    tmp_path: Path,
) -> None:
    """Traffic first, then the air, then what is heard: nothing waits for another step."""
    _, scenario = drafted(tmp_path, scene(tmp_path))
    assert scenario.title == "scene"
    values = scenario.components["traffic"].values
    (rule,) = values["equipment"].values()
    assert (rule.radio, rule.lidar) == (1.0, 0.0)
    assert values["scene"] == tmp_path / "scene.sumocfg"
    assert not values.get("entities")
    found = {f"{each.source} > {each.target}" for each in scenario.connections}
    assert found == {
        "traffic.vehicle > facilities.vehicle",
        "traffic.vehicle > channel.vehicle",
        "traffic.building > channel.building",
        "facilities.packets > channel.packets",
        "channel.receptions > facilities.receptions",
    }
    processes = [
        name for name, use in scenario.components.items() if use.process is Isolation.ON_REQUEST
    ]
    assert sorted(processes) == ["channel", "traffic"]


def test_every_assumption_is_written_above_the_scenario(tmp_path: Path) -> None:
    made, _ = drafted(tmp_path, scene(tmp_path))
    comments = [line for line in made.text.splitlines() if line.startswith("#   * ")]
    assert comments == [f"#   * {each}" for each in made.assumptions]
    (seed,) = (each for each in made.assumptions if "random numbers" in each)
    assert "sumo_seed" not in seed


def test_a_seed_of_the_scene_is_named(tmp_path: Path) -> None:
    made, scenario = drafted(tmp_path, scene(tmp_path, options='<seed value="23"/>'))
    assert any("`sumo_seed: 23`" in each for each in made.assumptions)
    assert scenario.seed == 1


def outputs(count: int) -> str:
    """Elements with which SUMO writes that many files, two of them to the last one."""
    names = [*range(count), count - 1]
    return "".join(f'<laneData id="d{k}" file="out{name}.xml"/>' for k, name in enumerate(names))


@pytest.mark.parametrize(("count", "more"), [(1, ""), (8, ""), (9, " and 1 more")])
def test_files_that_sumo_writes_are_named_once_each_and_of_many_the_rest_is_counted(
    tmp_path: Path, count: int, more: str
) -> None:
    made, _ = drafted(tmp_path, scene(tmp_path, extra=outputs(count)))
    shown = ", ".join(f"`out{k}.xml`" for k in range(min(count, 8)))
    expected = f"SUMO writes the files that the scene names: {shown}{more}"
    assert made.assumptions[-1] == expected


def test_without_such_files_nothing_is_said_of_them(tmp_path: Path) -> None:
    made, _ = drafted(tmp_path, scene(tmp_path))
    assert not any("SUMO writes" in each for each in made.assumptions)


def test_the_scene_is_named_from_where_the_scenario_is(tmp_path: Path) -> None:
    """Relative within its folder, whatever characters are in its name; from elsewhere in full."""
    inner, beside = tmp_path / "it's: here", tmp_path / "beside"
    inner.mkdir()
    beside.mkdir()
    config = scene(inner)
    made, scenario = drafted(tmp_path, config)
    assert "scene: 'it''s: here/scene.sumocfg'" in made.text
    assert scenario.components["traffic"].values["scene"] == config
    made, scenario = drafted(beside, config)
    assert scenario.components["traffic"].values["scene"] == config
    assert str(tmp_path).replace("'", "''") in made.text
