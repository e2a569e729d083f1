"""An experiment read again from its directory, without the files that it was made from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from orchestrator.campaign.journal import read_lines
from orchestrator.errors import CosimError
from orchestrator.experiment import tables
from orchestrator.experiment.journal import IDENTITY, RUNS, entries
from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import Results
from orchestrator.recording.layout import RecordingError, read_json
from orchestrator.scenario.document import Document


class StoredError(CosimError):
    """The directory holds no experiment, or one that cannot be read. Exit code 2."""


def is_experiment(directory: Path) -> bool:
    """Whether there is an experiment in `directory`, rather than a run."""
    return (directory / IDENTITY).is_file()


def read(directory: Path) -> Results:
    """What was planned, and what became of it until now.

    Raises:
        StoredError: there is no experiment, or one of another version of nlosim.
        RecordingError: the file that says what it is is damaged.
    """
    try:
        known = read_json(directory / IDENTITY)
        lines = read_lines(directory / RUNS)
        results = entries(lines.contents)
    except OSError as error:
        raise StoredError(f"`{directory}` holds no experiment: {error}") from error
    try:
        _check_shape(directory / IDENTITY, known)
        experiment, sessions = _experiment(directory, known), known["sessions"]
    except (KeyError, TypeError) as error:
        what = f"`{directory / IDENTITY}` is not of this version of nlosim: {error} is missing"
        raise StoredError(what) from error
    rows = tables.rows(experiment, results)
    ordered = sorted(results, key=lambda key: (key.combination, key.seed))
    return Results(
        experiment=experiment,
        rows=rows,
        metrics=[results[key].metrics for key in ordered],
        sessions=sessions,
        damaged=lines.damaged,
    )


def _check_shape(path: Path, known: Mapping[str, Any]) -> None:
    """Refuse what no journal writes; there are no checksums in a file that is for people, too.

    Raises:
        KeyError: something is missing.
        RecordingError: a value is of another kind.
    """
    combinations = known["combinations"]
    is_sound = (
        _is_list_of(int, known["seeds"])
        and _is_list_of(dict, known["sessions"])
        and _is_mapping_of_texts(known["metrics"])
        and isinstance(known["file"], str)
        and isinstance(known["scenario_file"], str)
        and _is_list_of(dict, combinations)
        and all(
            _is_mapping_of_texts(each["levels"])
            and _is_list_of(str, each["overrides"])
            and isinstance(each["scenario"], dict)
            for each in combinations
        )
    )
    if not is_sound:
        raise RecordingError(f"`{path}` is damaged: a value in it is of another kind")


def _is_list_of(kind: type, value: object) -> bool:
    return isinstance(value, list) and all(isinstance(each, kind) for each in value)


def _is_mapping_of_texts(value: object) -> bool:
    return isinstance(value, dict) and _is_list_of(str, [*value.values()])


def _experiment(directory: Path, known: Mapping[str, Any]) -> Experiment:
    report = known["report"]
    return Experiment(
        path=Path(known["file"]),
        scenario=Path(known["scenario_file"]),
        seeds=tuple(known["seeds"]),
        combinations=tuple(
            Combination(each["levels"], tuple(each["overrides"]), each["scenario"])
            for each in known["combinations"]
        ),
        metrics=known["metrics"],
        report=None if report is None else ReportPlan(**report),
        transport=known.get("transport"),
        document=Document(str(directory / IDENTITY), known, {}),
    )
