"""Foresight and luck: what is finished of experiments, and its part of the page."""

import json
from pathlib import Path
from typing import Any

import pytest

from studies.method import records
from studies.relay.foresight import RUNS, Run, finished, main, part, write
from tests.studies.results import SESSION

RATES = {"oracle": 0.98, "expected-prr": 0.92, "mohed": 0.9}


def directory(folder: Path, rates: dict[str, list[float]], planned: int = 9) -> Path:
    """An experiment of which a run per rate is finished, from seed 0 on, and one failed."""
    folder.mkdir()
    plan = {
        "combinations": [{"levels": {"method": method}} for method in rates],
        "file": f"/somewhere/{folder.name}.yaml",
        "seeds": list(range(planned)),
        "sessions": [SESSION],
    }
    (folder / "experiment.json").write_text(json.dumps(plan))
    notes: list[dict[str, Any]] = []
    for k, prrs in enumerate(rates.values()):
        for seed, prr in enumerate(prrs):
            metrics = {"prr": {"end_to_end": prr}, "relay_switches": 3}
            notes.append({"seed": seed, "combination": k, "metrics": metrics, "error": None})
    notes.append({"seed": 8, "combination": 0, "metrics": None, "error": "it fell over"})
    notes.insert(0, {"seed": 0, "combination": 0, "metrics": None, "error": "tried again"})
    (folder / "runs.jsonl").write_text("".join(json.dumps(note) + "\n" for note in notes))
    return folder


def study(folder: Path) -> None:
    """The study's own results at these seeds, `oracle` and others."""
    table = [
        {
            "method": method,
            "density": density,
            "speed": "30 km/h",
            "seed": seed,
            "prr": rate + 0.001 * seed - (density == "20 m"),
            "relay_switches": 2,
        }
        for method, rate in RATES.items()
        for density in ("20 m", "30 m")
        for seed in range(4)
    ]
    records.write(folder / "relay_runs.csv", table)


def test_what_is_finished_is_read_the_last_attempt_of_each(tmp_path: Path) -> None:
    runs, origin = finished(directory(tmp_path / "fair", {"fair-oracle": [0.95, 0.93]}))
    assert runs == [
        Run(method="fair-oracle", seed=0, prr=0.95, relay_switches=3),
        Run(method="fair-oracle", seed=1, prr=0.93, relay_switches=3),
    ]
    assert (origin.planned, origin.runs, origin.failed, origin.seeds) == (9, 3, 1, "0..1")
    assert origin.experiment == "studies/relay/experiments/fair.yaml"


def test_without_the_experiments_the_page_has_no_such_part(tmp_path: Path) -> None:
    assert part(tmp_path, "results") == []


def test_luck_and_foresight_are_differences_by_the_same_seeds(tmp_path: Path) -> None:
    """The knowing one 98.0 and 98.1, the fair one 95 and 94, the policy 92.0 and 92.1."""
    study(tmp_path)
    fair = directory(tmp_path / "fair", {"fair-oracle": [0.95, 0.94]})
    ahead = directory(tmp_path / "ahead", {"mohed-trajectories": [0.93]})
    write(tmp_path, [fair, ahead])
    assert len(records.read(tmp_path / RUNS, Run)) == 3
    lines = "\n".join(part(tmp_path, "results")).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if "|" in line]
    cells = {row[0]: row[1:] for row in rows}
    luck = cells["oracle minus fair oracle"]
    assert (luck[0], luck[1].split(" [")[0], luck[2]) == ("2", "3.6", "luck")
    assert cells["fair oracle minus expected PRR"][1].split(" [")[0] == "2.4"
    assert cells["MoHeD, trajectories minus MoHeD"][:2] == ["1", "3.0"]
    assert cells["oracle"][:2] == ["2", "98.0 [97.4, 98.7]"]


def test_a_directory_without_an_experiment_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["foresight", str(tmp_path), str(tmp_path / "nothing")])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert "experiment.json`; `make paper-oracle` makes it" in capsys.readouterr().err
