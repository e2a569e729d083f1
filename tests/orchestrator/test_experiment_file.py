"""Experiment files: what they mean, and every problem at its place."""

import os
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.campaign.work import RunKey
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import ReportPlan
from orchestrator.scenario.build import load_scenario

FILE = """\
schema: 1
scenario: two.yaml
seeds: 2
set: {report: trace, components.car.parameters.label: a b}
factors:
  pace:
    fast: {components.car.parameters.mode: fast}
    slow: {components.car.parameters.mode: slow}
  power:
    low: {components.car.parameters.power: 10 dBm}
    high: {components.car.parameters.power: 20 dBm, components.base.parameters.gain: 3}
metrics: {distance: distance_m}
"""


def write(scenario: Path, text: str) -> Path:
    path = scenario.with_name("experiment.yaml")
    path.write_text(text)
    return path


def problems(scenario: Path, text: str) -> list[str]:
    path = write(scenario, text)
    with pytest.raises(ScenarioError) as error:
        load_experiment(path)
    return [str(problem).removeprefix(f"{path.parent}/") for problem in error.value.problems]


def test_every_level_meets_every_other_with_the_same_seeds(scenario_file: Path) -> None:
    experiment = load_experiment(write(scenario_file, FILE))
    assert [tuple(c.levels.values()) for c in experiment.combinations] == [
        ("fast", "low"),
        ("fast", "high"),
        ("slow", "low"),
        ("slow", "high"),
    ]
    expected = [RunKey(seed, index) for seed in (1, 2) for index in range(4)]
    assert experiment.runs() == expected
    last = experiment.combinations[-1].resolved["components"]
    assert last["car"]["parameters"]["mode"] == "slow"
    assert last["car"]["parameters"]["label"] == "a b"
    assert last["base"]["parameters"]["gain"] == pytest.approx(3)


def test_overrides_are_those_of_the_command_line(scenario_file: Path) -> None:
    experiment = load_experiment(write(scenario_file, FILE))
    for combination in experiment.combinations:
        scenario = load_scenario(experiment.scenario, combination.overrides)
        assert {**combination.resolved, "seed": scenario.seed} == scenario.resolved()


ENDING = FILE.replace("report: trace", "report: trace, components.alarm: {type: alarm, step: 1 s}")


def test_levels_can_say_until_when_a_run_goes(scenario_file: Path) -> None:
    text = ENDING.replace(
        "{components.car.parameters.mode: slow}", "{time.until: alarm.bell.rings}"
    )
    experiment = load_experiment(write(scenario_file, text))
    assert [c.resolved["time"].get("until") for c in experiment.combinations] == [
        *[None] * 2,
        *["alarm.bell.rings"] * 2,
    ]


@pytest.mark.parametrize(
    ("until", "what"),
    [
        ("alarm.lamps", "it is an output of type bool[2], and must be an output of type bool[]"),
        ("alrm.bell.rings", "there is no component `alrm`; did you mean `alarm`?"),
    ],
)
def test_a_wrong_end_is_a_problem_of_the_setting(
    scenario_file: Path, until: str, what: str
) -> None:
    text = ENDING.replace("{components.car.parameters.mode: slow}", f"{{time.until: {until}}}")
    (problem,) = problems(scenario_file, text)
    assert problem.startswith(f"experiment.yaml:8:24: time.until: {what}")


def test_the_command_of_a_run_quotes_for_the_shell(scenario_file: Path) -> None:
    command = load_experiment(write(scenario_file, FILE)).command(RunKey(2, 0))
    assert command.startswith(f"nlosim run {scenario_file} --seed 2 --set 'report=\"trace\"'")
    assert "--set 'components.car.parameters.label=\"a b\"'" in command


def test_the_command_of_a_run_says_where_components_are(scenario_file: Path) -> None:
    experiment = load_experiment(write(scenario_file, FILE))
    plain = shlex.split(experiment.command(RunKey(1, 3)))
    hosts = Path("/a b/hosts.yaml")
    for more, words in (
        ({"transport": "zenoh"}, ["--transport", "zenoh"]),
        ({"hosts": hosts}, ["--hosts", str(hosts)]),
        ({"transport": "local", "hosts": hosts}, ["--transport", "local", "--hosts", str(hosts)]),
    ):
        said = shlex.split(replace(experiment, **more).command(RunKey(1, 3)))
        assert said == [*plain[:5], *words, *plain[5:]]


@pytest.mark.parametrize(
    ("seeds", "expected"),
    [("3", (1, 2, 3)), ("7..9", (7, 8, 9)), ("7..7", (7,)), ("[5, 0]", (5, 0))],
)
def test_seeds(scenario_file: Path, seeds: str, expected: tuple[int, ...]) -> None:
    text = FILE.replace("seeds: 2", f"seeds: {seeds}")
    assert load_experiment(write(scenario_file, text)).seeds == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("seeds: 2", "seeds: 0", "3:8: seeds: must be between 1 and 1000000 seeds, got 0"),
        ("seeds: 2", "seeds: 9..1", '3:8: seeds: "9..1" is not a range of 1 to 1000000 seeds'),
        (
            "seeds: 2",
            "seeds: 5..1000005",
            '3:8: seeds: "5..1000005" is not a range of 1 to 1000000 seeds',
        ),
        ("seeds: 2", "seeds: [1, 1]", "3:8: seeds: the seed 1 is listed twice"),
        ("seeds: 2", "seeds: []", "3:8: seeds: must not be empty"),
        (
            "seeds: 2",
            "seeds: [1.5]",
            "3:8: seeds: a seed is a whole number of at least 0, got 1.5",
        ),
        (
            "seeds: 2",
            "seeds: many",
            (
                "3:8: seeds: expected a number of seeds, a range such as `1..50`, "
                'or a list of seeds, got "many"'
            ),
        ),
        (
            "seeds: 2",
            "seeds: 2\nfactor: {}",
            "4:1: the experiment: `factor` is not a key here; did you mean `factors`?",
        ),
        ("seeds: 2\n", "", "1:1: the experiment: `seeds` is missing"),
        (
            "{distance: d",
            "{power: d",
            "12:11: metrics.power: `power` is a column of the factor `power`; choose another name",
        ),
        (
            "{distance: d",
            "{n: d",
            "12:11: metrics.n: `n` is a column of every table of results; choose another name",
        ),
        (
            "factors:\n  pace:",
            "factors:\n  n: {one: {}}\n  pace:",
            "6:3: factors.n: `n` is a column of every table of results; choose another name",
        ),
        (
            "report: trace, ",
            "report: trace, seed: 3, ",
            "4:22: set.seed: the seeds are those of `seeds`",
        ),
        (
            "gain: 3",
            "gain: 3, report: trace",
            "11:89: factors.power.high.report: `set` sets `report`, too",
        ),
        (  # what is written first would be lost without a word
            "gain: 3}",
            "gain: 3, components.base.parameters: {}}",
            (
                "11:53: factors.power.high.components.base.parameters.gain: "
                "`components.base.parameters`, below, replaces all that is in it; "
                "write this one after it"
            ),
        ),
        (
            "label: a b",
            "mode=x: 1",
            (
                "4:22: set.components.car.parameters.mode=x: "
                "`components.car.parameters.mode=x` is not a path; "
                "write keys with dots, e.g. `time.stop`"
            ),
        ),
        (  # an override is a problem of the experiment file, at its key or its value
            "mode: slow",
            "mod: slow",
            (
                "8:12: components.car.parameters.mod: there is no parameter `mod`; "
                "did you mean `mode`?"
            ),
        ),
        (
            "mode: slow",
            "mode: slwo",
            '8:44: components.car.parameters.mode: cannot be "slwo"; did you mean `slow`?',
        ),
        (
            "report: trace, ",
            "",
            (
                "2:11: scenario: the scenario names no `report` and no `measures`: "
                "its runs have no metrics"
            ),
        ),
    ],
)
def test_problems(scenario_file: Path, old: str, new: str, expected: str) -> None:
    assert problems(scenario_file, FILE.replace(old, new)) == [f"experiment.yaml:{expected}"]


def skipping(*rules: str) -> str:
    return FILE + "skip:\n" + "".join(f"  - {rule}\n" for rule in rules)


def test_combinations_are_skipped(scenario_file: Path) -> None:
    text = skipping("{pace: slow, power: [low]}")
    experiment = load_experiment(write(scenario_file, text))
    assert [tuple(c.levels.values()) for c in experiment.combinations] == [
        ("fast", "low"),
        ("fast", "high"),
        ("slow", "high"),
    ]
    assert len(experiment.runs()) == 6
    assert experiment.levels == {"pace": ("fast", "slow"), "power": ("low", "high")}
    left = load_experiment(write(scenario_file, skipping("{pace: slow}"))).levels
    assert left == {"pace": ("fast",), "power": ("low", "high")}


def test_what_is_skipped_need_not_be_sound(scenario_file: Path) -> None:
    """`slow` allows for five vehicles; the combination that has six is left out."""
    text = FILE.replace("gain: 3", "gain: 3, components.car.parameters.count: 6")
    text += "skip: [{pace: slow, power: high}]\n"
    assert len(load_experiment(write(scenario_file, text)).combinations) == 3


@pytest.mark.parametrize(
    ("rules", "expected"),
    [
        (
            ["{pase: slow}"],
            "14:6: skip[0].pase: there is no factor `pase`; did you mean `pace`?",
        ),
        (
            ["{pace: slow}", "{power: [low, hihg]}"],
            (
                "15:19: skip[1].power[1]: the factor `power` has no level `hihg`; "
                "did you mean `high`?"
            ),
        ),
        (
            ["{power: medium}"],
            (
                "14:13: skip[0].power: the factor `power` has no level `medium`; "
                "there are: high, low"
            ),
        ),
        (
            ["{pace: slow}", "{pace: slow, power: low}"],
            "15:5: skip[1]: the rules before it leave out all that this one matches; remove it",
        ),
        (
            ["{pace: slow}", "{pace: fast}"],
            "15:5: skip[1]: leaves nothing to run",
        ),
        (["{}"], "14:5: skip[0]: must not be empty"),
        (["{pace: []}"], "14:12: skip[0].pace: must not be empty"),
        (
            ["{pace: 3}"],
            (
                "14:12: skip[0].pace: expected a level or a list of levels, got 3; "
                "write '3' in quotes"
            ),
        ),
        (
            ["{pace: {slow: true}}"],
            "14:12: skip[0].pace: expected a level or a list of levels, got a mapping",
        ),
    ],
)
def test_problems_of_skipping(scenario_file: Path, rules: list[str], expected: str) -> None:
    assert problems(scenario_file, skipping(*rules)) == [f"experiment.yaml:{expected}"]


@pytest.mark.parametrize("text", ["report: tally", "report: {type: tally}"])
def test_a_report_in_short_and_in_full(scenario_file: Path, text: str) -> None:
    experiment = load_experiment(write(scenario_file, f"{FILE}{text}\n"))
    assert experiment.report == ReportPlan(name="tally", parameters={})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "report: taly",
            ("13:9: report: no report of experiments `taly` is installed; did you mean `tally`?"),
        ),
        (
            "report: {type: misnamed}",
            (
                "13:16: report.type: the report of experiments `misnamed` is not a class "
                "derived from `ExperimentReport`"
            ),
        ),
        (
            "report: {type: tally, parameters: {unti: x}}",
            "13:36: report.parameters.unti: write `unit`",
        ),
        (
            "report: {type: tally, parameters: {unit: 3}}",
            "13:42: report.parameters.unit: expected text",
        ),
        ("report: {parameters: {unit: x}}", "13:1: report: `type` is missing"),
        (
            "report: {type: tally, parameter: {}}",
            "13:23: report: `parameter` is not a key here; did you mean `parameters`?",
        ),
    ],
)
def test_problems_of_the_report(scenario_file: Path, text: str, expected: str) -> None:
    assert problems(scenario_file, f"{FILE}{text}\n") == [f"experiment.yaml:{expected}"]


def test_a_scenario_that_is_not_there(scenario_file: Path) -> None:
    (problem,) = problems(scenario_file, FILE.replace("two.yaml", "three.yaml"))
    absent = scenario_file.with_name("three.yaml")
    assert problem.endswith(f"there is no file {absent} (the path is relative to this file)")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes among files")
def test_a_pipe_is_no_scenario(scenario_file: Path) -> None:
    pipe = scenario_file.with_name("three.yaml")
    os.mkfifo(pipe)
    (problem,) = problems(scenario_file, FILE.replace("two.yaml", "three.yaml"))
    assert problem.endswith(f"{pipe} is a pipe, not a file")


def test_a_problem_of_one_combination_names_it(scenario_file: Path) -> None:
    """Each level alone is sound; `slow` allows for five vehicles."""
    text = FILE.replace("gain: 3", "gain: 3, components.car.parameters.count: 6")
    (problem,) = problems(scenario_file, text)
    assert problem.startswith("two.yaml:")
    assert "`slow` allows for 5 vehicles at most" in problem
    assert problem.endswith("(with pace slow, power high)")
