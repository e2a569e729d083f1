"""Results of experiments that never ran, and what a study's command makes of a folder."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import Results

SESSION = {
    "command": "nlosim experiment study.yaml",
    "created": "2026-01-01T00:00:00+00:00",
    "commit": "abcdef",
    "versions": {"nlosim": "1", "python": "3.11", "pydantic": "2"},
    "host": {"name": "secret", "cpu": "a CPU", "cpus": 2, "memory_gib": 8.0, "platform": "Linux"},
}

Levels = Mapping[str, str]
Outcome = Callable[[Levels, int], Mapping[str, Any] | None]
"""Of levels and seed: the metrics, or `None` for a run that failed."""


def results(plan: Experiment, outcome: Outcome, *, without: int | None = None) -> Results:
    """All runs, without those of one seed if `without` says so."""
    rows = []
    for combination in plan.combinations:
        for seed in plan.seeds:
            if seed == without:
                continue
            found = outcome(combination.levels, seed)
            metrics = dict.fromkeys(plan.metrics) if found is None else found
            error = "it broke" if found is None else None
            state = {"fingerprint": "0", "wall_s": 5.0, "cpu_s": None, "error": error}
            rows.append({**combination.levels, "seed": seed, **metrics, **state})
    return Results(experiment=plan, rows=rows, metrics=[{} for _ in rows], sessions=[SESSION])


def check_manual(
    study: str, page: Callable[[Path, str, Path], str], file: str | None = None
) -> None:
    """Whether the page of a study in the manual is what `page` makes of the results beside it.

    Args:
        study: its name.
        page: of the folder of results, its name in links, and the analysis.
        file: the name of the page in the manual; by default that of the study says it.
    """
    docs = Path(__file__).parents[2] / "docs"
    found = docs / (file or f"{study}-study.md")
    if not found.is_file():
        pytest.skip("`make paper` has not been run yet")
    folder = docs / "results"
    wanted = page(folder, "results", folder / f"{study}-analysis.md")
    assert found.read_text() == wanted, "run the last line of `make paper`"


def refusal(
    main: Callable[[], None], monkeypatch: pytest.MonkeyPatch, *arguments: Path
) -> int | str | None:
    """The exit code of the command of a study that does not make a page."""
    monkeypatch.setattr("sys.argv", ["study", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        main()
    return stopped.value.code


def check_missing(
    file: str,
    main: Callable[[], None],
    monkeypatch: pytest.MonkeyPatch,
    empty: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Whether the command of a study names the `file` that it lacks in an `empty` folder."""
    assert refusal(main, monkeypatch, empty / "page.md", empty) == 2
    assert f"{file}`; `make paper` writes it" in capsys.readouterr().err
    assert not (empty / "page.md").exists()
