"""The files of the reports and of the whole campaign, and the page."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import scenarios
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import Experiment
from studies.collision import CollisionStudy, figures
from studies.collision.__main__ import main
from studies.collision.page import page
from studies.collision.report import write_campaign
from studies.collision.runs import EXPERIMENTS, Point, points, read, run_rows
from studies.collision.statistics import Result
from studies.method import records
from studies.method.style import method_name
from tests.studies.collision import synthetic
from tests.studies.collision.synthetic import chance, experiment, run, scenario
from tests.studies.results import Levels, check_manual, check_missing, refusal, results

PRR = {"mohed": 0.9, "signal-strength": 0.8, "random": 0.6, "direct": 0.4}
NAMES = [method_name(method) for method in ("mohed", "direct")]
PLANS = {
    "collision_policies": synthetic.policies,
    "collision_constant_per": synthetic.constant_per,
    "collision_speed": synthetic.speed,
    "collision_memory": synthetic.memory,
    "collision_relay": synthetic.relay,
    "collision_radio": synthetic.radio,
    "collision_load": synthetic.load,
}


def outcome(levels: Levels, seed: int) -> dict[str, Any]:
    """More collisions with more losses."""
    if "policy" in levels:
        return run(chance(seed) < (0.6 if levels["policy"] == "blind" else 0.0), prr=1.0)
    per = float(levels["per"].split()[0]) / 100 if "per" in levels else 1 - PRR[levels["method"]]
    return run(chance(seed) < per**2, prr=1.0 - per)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All reports."""
    folder = tmp_path_factory.mktemp("results")
    for plan in PLANS.values():
        CollisionStudy().write(results(plan(), outcome), folder)
    return folder


@pytest.fixture
def copy(campaign: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(campaign, tmp_path / "results"))


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are made but not painted; `test_equal_results_make_equal_bytes` has their bytes."""
    monkeypatch.setattr(figures, "write", lambda figure, path: None)


def read_points(folder: Path, name: str) -> list[Point]:
    return points(name, read(folder, name))


def written(folder: Path) -> dict[str, bytes]:
    write_campaign(folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_equal_results_make_equal_bytes(campaign: Path, copy: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(campaign, tmp_path / "other"))
    first = written(copy)
    assert first == written(other)
    assert sorted(set(first) - {path.name for path in campaign.iterdir()}) == [
        "collision.csv",
        "collision_assumption.csv",
        "collision_claims.csv",
        "collision_critical.csv",
        "collision_linearity.csv",
        "collision_load.png",
        "collision_load.svg",
        "collision_partners.csv",
        "collision_policies.png",
        "collision_policies.svg",
        "collision_radio.png",
        "collision_radio.svg",
        "figure9_10.csv",
        "figure9_10.png",
        "figure9_10.svg",
    ]


def test_the_runs_come_back_from_their_file(campaign: Path) -> None:
    for name, plan in PLANS.items():
        rows = run_rows(results(plan(), outcome), "cooperative")
        for found, wanted in zip(read_points(campaign, name), points(name, rows), strict=True):
            assert found.condition == wanted.condition
            for seed, one in wanted.runs.items():
                again = found.runs[seed]
                assert again.per == pytest.approx(one.per, abs=1e-6)
                assert again.served == pytest.approx(one.served, abs=1e-6)
                assert replace(again, per=one.per, served=one.served) == one


def test_runs_that_failed_do_not_count(tmp_path: Path) -> None:
    broken = results(
        synthetic.policies(), lambda levels, seed: None if seed < 111 else outcome(levels, seed)
    )
    found = CollisionStudy().write(broken, tmp_path)
    assert {row["runs"] for row in found.tables["collision_policies"]} == {10}
    assert {len(point.runs) for point in read_points(tmp_path, "collision_policies")} == {10}
    origin = json.loads((tmp_path / "collision_policies_provenance.json").read_text())
    assert origin["failed"] == 50


def test_an_interrupted_experiment_has_a_report_of_what_there_is(tmp_path: Path) -> None:
    whole = results(synthetic.relay(), outcome)
    part = replace(whole, rows=whole.rows[:5], metrics=whole.metrics[:5])
    CollisionStudy().write(part, tmp_path)
    write_campaign(tmp_path)
    assert "5 of 320 runs" in page(tmp_path, "results")


def test_the_origin_names_no_host(campaign: Path) -> None:
    assert "secret" not in (campaign / "collision_relay_provenance.json").read_text()


@pytest.mark.usefixtures("unpainted")
def test_times_of_the_expert_reach_the_table_of_all(copy: Path) -> None:
    written(copy)
    rows = records.read(copy / "collision.csv", Result)
    here = {row.experiment for row in rows if row.sct and row.speed_kmh == 30.0}
    assert here == set(EXPERIMENTS) - {"collision_speed"}  # that is at 25 km/h
    assert all(not row.sct for row in rows if row.speed_kmh == 25.0)


@pytest.mark.usefixtures("unpainted")
def test_the_page_has_the_numbers_and_keeps_what_was_written_by_hand(
    copy: Path, tmp_path: Path
) -> None:
    written(copy)
    analysis = tmp_path / "analysis.md"
    analysis.write_text("## Analysis\n\nBecause of the queue.\n")
    text = page(copy, "results", analysis)
    assert "Because of the queue." in text
    assert "](results/figure9_10.svg)" in text
    assert "was not run" not in text
    row = next(line for line in text.splitlines() if line.startswith("| blind, network | 20 |"))
    assert "47.3 ± 18.7" in row
    for title in (
        "Policies",
        "Claims",
        "Critical points",
        "Is it linear?",
        "Weaker radios",
        "Loads and losses",
    ):
        assert f"## {title}\n" in text
    analysis.unlink()
    assert "Because" not in page(copy, "results", analysis)


@pytest.mark.usefixtures("unpainted")
def test_loads_stand_beside_the_single_packets_of_the_relay_experiment(copy: Path) -> None:
    written(copy)
    text = page(copy, "results").split("## Loads and losses\n")[1].split("\n## ")[0]
    rows = [line.split(" | ")[:2] for line in text.splitlines() if line.startswith("| ")]
    cases = ("probe, frame", "full, frame", "full, packets", "full, keypoint")
    assert sorted(rows[2:]) == sorted([f"| {case}", name] for case in cases for name in NAMES)


@pytest.mark.usefixtures("unpainted")
def test_weaker_radios_stand_beside_those_of_the_relay_experiment(copy: Path) -> None:
    written(copy)
    text = page(copy, "results").split("## Weaker radios\n")[1].split("\n## ")[0]
    rows = [line.split(" | ")[:2] for line in text.splitlines() if line.startswith("| ")]
    assert sorted(rows[2:]) == sorted([f"| {n}", p] for p in ("26", "20", "10") for n in NAMES)


@pytest.mark.usefixtures("unpainted")
@pytest.mark.parametrize("missing", EXPERIMENTS)
def test_an_experiment_that_was_not_run_is_named_and_the_rest_is_there(
    copy: Path, missing: str
) -> None:
    (copy / f"{missing}_runs.csv").unlink()
    (copy / f"{missing}_provenance.json").unlink()
    written(copy)
    text = page(copy, "results")
    assert f"**{missing} was not run**" in text
    wanted = f"studies/collision/experiments/{missing}.yaml --out runs/{missing}"
    assert f"`nlosim experiment {wanted}`" in text
    assert text.count("was not run") == 1
    assert f"[every run](results/{missing}_runs.csv)" not in text


def test_a_folder_without_results_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    check_missing("collision_policies_runs.csv", main, monkeypatch, tmp_path, capsys)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((",True,", ",perhaps,"), "expected `True`, `False` or nothing, got `perhaps`"),
        (("speed_kmh", "speed"), "there is no column 'speed_kmh'; run the report again"),
    ],
)
def test_a_file_that_no_report_wrote_is_an_error(
    copy: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    change: tuple[str, str],
    message: str,
) -> None:
    path = copy / "collision_relay_runs.csv"
    path.write_text(path.read_text().replace(*change))
    assert refusal(main, monkeypatch, copy.parent / "page.md", copy) == 2
    error = capsys.readouterr().err
    assert message in error
    assert str(path) in error


def problems(changed: Experiment) -> list[tuple[tuple[str | int, ...], str]]:
    return [(each.address, each.what) for each in CollisionStudy().check(changed)]


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
def test_a_sound_experiment_has_no_problems(plan: Any) -> None:
    assert problems(plan()) == []


def test_metrics_that_are_missing_are_named() -> None:
    found = experiment("any", [({}, scenario())], metrics={"prr": "prr.end_to_end"})
    ((address, what),) = problems(found)
    assert address == ()
    assert what.startswith("the collision study needs the metric `collision: collision` and")
    assert "`direct_prr: prr.direct`" in what
    assert "`prr: prr.end_to_end`" not in what


def test_conditions_that_the_study_cannot_tell_apart_are_a_problem() -> None:
    """Otherwise runs of both would be counted as one condition."""
    found = experiment(
        "any", [({"spacing": "20 m"}, scenario()), ({"spacing": "30 m"}, scenario())]
    )
    ((_, what),) = problems(found)
    assert what.startswith("the combinations (spacing 20 m) and (spacing 30 m) are the same")
    assert what.endswith(
        "policy, relay, compression, speed_kmh, channel, per, load, granularity, maximum_age, "
        "transmit_power"
    )


@pytest.mark.parametrize("name", ["facilities", "channel", "relay", "traffic", "policy"])
def test_a_scenario_that_does_not_tell_the_condition_is_a_problem(name: str) -> None:
    made = scenario()
    del made["components"][name]
    ((_, what),) = problems(experiment("any", [({}, made)]))
    assert f"no component `{name}`" in what


@pytest.mark.parametrize(
    ("ego", "told"),
    [
        (None, "no entity `ego`"),
        (
            {"speed": {"uniform": ["7.0 m/s", "9.0 m/s"]}},
            "the speed of the entity `ego` is drawn from {'uniform': ['7.0 m/s', '9.0 m/s']}",
        ),
    ],
)
def test_an_ego_that_has_no_single_speed_is_a_problem(ego: object, told: str) -> None:
    made = scenario()
    made["components"]["traffic"]["parameters"]["entities"]["ego"] = ego
    ((_, what),) = problems(experiment("any", [({}, made)]))
    assert told in what


FILE = """\
schema: 1
scenario: {scenario}
seeds: 3
factors:
  method:
    direct: {{components.relay.type: relay-direct}}
metrics:
  collision: collision
  collision_time: collision_time
  collision_partner: collision_partner
  success: success
  completion_time: completion_time
  prr: prr.end_to_end
  direct_prr: prr.direct
  begin: session.begin
  served: session.served
  relay_switches: relay_switches
  min_gap_m: min_gap_m
report:
  type: collision-study
  parameters:
    {parameters}
"""


@pytest.mark.parametrize(
    ("parameters", "place", "what"),
    [
        (
            "polcy: blind",
            "22:5",
            "report.parameters.polcy: there is no parameter `polcy`; did you mean `policy`?",
        ),
        (
            "policy: 3",
            "22:13",
            "report.parameters.policy: expected the name of a policy, e.g. `cooperative`",
        ),
    ],
)
def test_wrong_parameters_are_named_with_their_place(
    tmp_path: Path, parameters: str, place: str, what: str
) -> None:
    path = tmp_path / "study.yaml"
    base = Path(scenarios.__file__).parent / "red_light_study.yaml"
    path.write_text(FILE.format(scenario=base, parameters=parameters))
    with pytest.raises(ScenarioError) as found:
        load_experiment(path)
    assert str(found.value) == f"{path}:{place}: {what}"


def test_an_experiment_without_networks_names_its_policy(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    base = Path(scenarios.__file__).parent / "red_light_study.yaml"
    path.write_text(FILE.format(scenario=base, parameters="policy: rule-based"))
    (row, *_) = run_rows(results(load_experiment(path), lambda *_: run(False)), "rule-based")
    found = row.condition
    assert (found.policy, found.compression) == ("rule-based", None)
    assert (found.relay, found.speed_kmh, found.channel) == ("direct", 30.0, "simulated")


def test_the_page_in_the_manual_is_that_of_the_results_beside_it() -> None:
    check_manual("collision", page)
