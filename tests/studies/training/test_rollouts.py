"""Driving: what of a run is kept, and what becomes of runs that fail."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.recording.layout import RecordingError
from studies.training.conduct import TrainingOutcome
from studies.training.learner import RecordedRun
from studies.training.load import load_training
from studies.training.samples import read_samples, write_samples
from tests.studies.training.conftest import Laboratory
from tests.studies.training.toys import GAIN, Line

SOME = "parameters: {fails: [0]}"


@given(samples=st.lists(st.binary(max_size=40), max_size=9))
def test_samples_are_read_as_they_were_written(
    tmp_path_factory: pytest.TempPathFactory, samples: list[bytes]
) -> None:
    path = tmp_path_factory.mktemp("samples") / "run.npz"
    write_samples(path, samples)
    assert read_samples(path) == tuple(samples)


def failing(laboratory: Laboratory, digits: str) -> TrainingOutcome:
    """The training in which the runs with these fates fail, one fate in ten each."""
    parameters = f"step: 100 ms, parameters: {{fails: [{digits}]}}"
    laboratory.change("step: 100 ms", parameters, "ball.yaml")
    return laboratory.train()


def test_what_the_learner_gets(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> None:
    """By seed, with the level of every factor, in the order of time, without empty samples."""
    got: list[list[RecordedRun]] = []
    original = Line.add

    def add(self: Line, runs: list[RecordedRun]) -> None:
        got.append(list(runs))
        original(self, got[-1])

    monkeypatch.setattr(Line, "add", add)
    laboratory.train()
    training = load_training(laboratory.file)
    assert [[run.seed for run in runs] for runs in got] == [
        list(training.lessons(number).seeds) for number in range(3)
    ]
    for run in got[0]:
        assert run.levels == training.encounters[0].levels(run.seed)
        assert len(run.samples) == 10  # the one at the start is empty
        position, command = np.array([np.frombuffer(sample) for sample in run.samples]).T
        np.testing.assert_allclose(command, GAIN * position)
        assert position[0] == (-2.0 if run.levels["start"] == "left" else 2.0)


def test_few_failures_are_left_out_and_reported(laboratory: Laboratory) -> None:
    laboratory.change("expert: {runs: 4}", "expert: {runs: 30}")
    laboratory.change("rounds: 2", "rounds: 0")
    laboratory.change("validation: {runs: 2}", "validation: {runs: 1}")
    found = failing(laboratory, "3")
    assert found.error is None
    assert 1 <= len(found.failed) <= 3
    for run, command in found.failed:
        assert run.phase == "expert"
        assert run.result.error is not None
        assert "the ball burst" in run.result.error
        assert f"--set seed={run.seed}" in command
        kept = laboratory.folder / "out" / "runs" / f"expert-{run.seed}"
        assert {path.name for path in kept.iterdir()} == {"attempt", "attempt-2"}
    _, expert = found.findings.phases
    assert expert["runs"] + expert["failed"] == 30
    assert expert["failed"] == len(found.failed)
    assert expert["samples"] == 10 * expert["runs"]
    again = laboratory.train(resume=True)  # the phase is over
    assert again.failed == found.failed


def test_many_failures_end_it_until_the_cause_is_mended(laboratory: Laboratory) -> None:
    laboratory.train("sound")
    sound = laboratory.checkpoint
    (laboratory.folder / "toy.safetensors").unlink()
    fates = "step: 100 ms, parameters: {fails: [0, 1, 2, 3, 4, 5, 6]}"
    training = load_training(laboratory.file)
    laboratory.change("step: 100 ms", fates, "ball.yaml")
    found = laboratory.train(encounters=training.encounters)
    assert found.error is not None
    assert "runs of the phase `" in str(found.error)
    assert "the ball burst" in str(found.error)
    assert "repeat it with: nlosim run " in str(found.error)
    assert not (laboratory.folder / "toy.safetensors").exists()
    laboratory.change(fates, "step: 100 ms", "ball.yaml")
    mended = laboratory.train(resume=True)
    assert (mended.error, mended.failed) == (None, [])
    assert laboratory.checkpoint == sound


def test_a_policy_without_samples(laboratory: Laboratory) -> None:
    laboratory.change("step: 100 ms", "step: 100 ms, parameters: {silent: true}", "ball.yaml")
    found = laboratory.train()
    assert "have no samples to learn from: `policy.sample` was empty all the time" in (
        str(found.error)
    )


def test_the_tables_say_how_the_drives_went(laboratory: Laboratory) -> None:
    laboratory.change("expert: {runs: 4}", "expert: {runs: 12}")
    found = laboratory.train()
    with (laboratory.folder / "out" / "phases.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["phase"] for row in rows] == ["validation", "expert", "dagger-1", "dagger-2"]
    assert [row["driver"] for row in rows] == ["expert", "expert", "round 0", "round 1"]
    assert [float(row["beta"]) for row in rows] == [1.0, 1.0, 0.5, 0.25]
    lines = (laboratory.folder / "out" / "journal.jsonl").read_text().splitlines()
    runs = [entry for line in lines if (entry := json.loads(line))["kind"] == "run"]
    for row in rows:
        ends = [r["result"]["metrics"]["collision"] for r in runs if r["phase"] == row["phase"]]
        share = sum(ends) / len(ends)
        assert float(row["collision"]) == share
        assert float(row["success"]) == pytest.approx(1 - share)
        assert float(row["collision_low"]) <= share <= float(row["collision_high"])
    with (laboratory.folder / "out" / "training.csv").open() as file:
        epochs = list(csv.DictReader(file))
    assert list(epochs[0]) == [
        *("round", "epoch", "training_loss", "validation_loss", "validation.largest"),
        *("seconds", "kept"),
    ]
    assert [row["kept"] for row in epochs].count("True") == 3
    assert "dagger-2" in found.summary


def test_metrics_are_not_needed(laboratory: Laboratory) -> None:
    laboratory.change("report: toy-report\n", "", "ball.yaml")
    found = laboratory.train()
    assert {row["collision"] for row in found.findings.phases} == {None}
    assert found.findings.chosen == 2


def test_attempts_leave_nothing_when_they_succeed(laboratory: Laboratory) -> None:
    laboratory.train()
    assert not (laboratory.folder / "out" / "runs").exists()
    files = list(Path(laboratory.folder / "out" / "samples").iterdir())
    assert {path.suffix for path in files} == {".npz"}


@pytest.mark.parametrize("place", [0, 3, 90, -30, -5, "cut", "empty", "ends"])
def test_samples_that_are_damaged_are_named(tmp_path: Path, place: int | str) -> None:
    """Whatever NumPy, zipfile and zlib raise for it."""
    path = tmp_path / "run.npz"
    write_samples(path, [b"abc", b"de"])
    content = bytearray(path.read_bytes())
    if place == "ends":
        np.savez_compressed(path, bytes=np.zeros(3, np.uint8), ends=np.array([9]))
    elif isinstance(place, str):
        path.write_bytes(b"" if place == "empty" else content[:50])
    else:
        content[place] ^= 0xFF
        path.write_bytes(content)
    with pytest.raises(RecordingError, match=f"`{path}` cannot be read"):
        read_samples(path)
