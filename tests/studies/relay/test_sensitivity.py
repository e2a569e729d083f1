"""The report `relay-sensitivity`, and its part of the page."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import Results
from studies.relay import RelaySensitivity, RelayStudy
from studies.relay.page import page
from tests.studies.relay.synthetic import experiment, run
from tests.studies.results import SESSION, results

RATES = {("study", "mohed"): 0.9, ("no factor 2", "mohed"): 0.5, ("study", "random"): 0.8}
CAUSES = ("unnoticed", "noise", "interference", "receiver_busy", "receiver_transmitting")
METRICS = {"prr": "prr.end_to_end", **{f"lost_{c}": f"prr.lost.{c}" for c in CAUSES}}


def plan(*, report: dict[str, Any] | None = None, metrics: Any = METRICS) -> Experiment:
    scenario = {"time": {"start": "0 s", "stop": "10 s"}, "components": {}}
    return replace(
        experiment(("mohed",)),
        combinations=tuple(
            Combination({"method": method, "setting": setting}, (), scenario)
            for setting, method in RATES
        ),
        metrics=metrics,
        report=ReportPlan(name="relay-sensitivity", parameters=report or {}),
    )


def found() -> Results:
    """Two runs each, a hundredth above and below the rate; half of what is lost is noise."""
    rows = []
    for (setting, method), rate in RATES.items():
        for seed, prr in enumerate((rate - 0.01, rate + 0.01)):
            lost = {f"lost_{cause}": 0.0 for cause in CAUSES}
            lost |= {"lost_noise": (1 - prr) / 2, "lost_interference": (1 - prr) / 2}
            state = {"fingerprint": "0", "wall_s": 5.0, "cpu_s": None, "error": None}
            rows.append({"method": method, "setting": setting, "seed": seed, "prr": prr})
            rows[-1] |= lost | state
    return Results(experiment=plan(), rows=rows, metrics=[{} for _ in rows], sessions=[SESSION])


def test_the_page_has_a_row_per_setting_and_where_packets_are_lost(tmp_path: Path) -> None:
    study = experiment(("mohed", "random"), (30.0,), base={"density": "30 m"})
    RelayStudy().write(results(study, lambda _levels, _seed: run(0.9)), tmp_path)
    assert "Sensitivity" not in page(tmp_path, "results")
    RelaySensitivity().write(found(), tmp_path)
    lines = page(tmp_path, "results").splitlines()
    part = lines[lines.index("## Where packets are lost") :]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in part if "|" in line]
    cells = {row[0]: row[1:] for row in rows}
    assert cells["no factor 2"][0].startswith("50.0 [")
    assert cells["no factor 2"][1] == ""
    assert [cell.split(" [")[0] for cell in cells["study"]] == ["90.0", "80.0"]
    lost = next(row for row in rows if row[0] == "MoHeD" and len(row) == 6)
    assert lost[1:] == ["0.0", "5.0", "5.0", "0.0", "0.0"]


def test_its_origin_is_written_beside_it(tmp_path: Path) -> None:
    RelaySensitivity().write(found(), tmp_path)
    origin = json.loads((tmp_path / "relay_sensitivity_provenance.json").read_text())
    assert (origin["runs"], origin["sessions"][0]["commit"]) == (6, "abcdef")
    assert origin["cost"][-1]["simulated_s"] == 60.0


def test_the_terminal_has_methods_beside_each_other(tmp_path: Path) -> None:
    text = RelaySensitivity().write(found(), tmp_path).text
    row = next(line for line in text.splitlines() if "no factor 2" in line)
    assert row.rstrip().endswith("-")


def test_what_it_needs_is_said_before_the_first_run() -> None:
    told = list(RelaySensitivity().check(plan(report={"base": 1}, metrics={"gap": "min_gap_m"})))
    assert [(p.address, p.what) for p in told] == [
        (("base",), "there is no parameter `base`"),
        ((), "the relay sensitivity needs the metric `prr`"),
    ]
    told = list(RelaySensitivity().check(experiment(("mohed",))))
    assert [p.what for p in told] == ["the relay sensitivity needs the factor `setting`"]
