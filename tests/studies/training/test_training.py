"""Training as a whole: the same network however often it was interrupted, and a better one."""

import contextlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from orchestrator.campaign.conduct import Interrupted
from orchestrator.campaign.journal import ResumeError
from orchestrator.cli.interruption import stopping
from orchestrator.recording.reader import Recording
from studies.training.journal import ENTRIES, Entry, Epoch, Journal, Run
from studies.training.learner import EpochResult, RecordedRun
from studies.training.plan import Phase
from studies.training.rollouts import Rollouts
from studies.training.rounds import LearningError
from tests.interruptions import InterruptedDestructor, record_ignored
from tests.studies.training.conftest import Laboratory
from tests.studies.training.toys import GAIN, Fall, Line


def without_times(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{k: v for k, v in row.items() if k not in {"seconds", "wall_s"}} for row in rows]


def interrupting(every: int, *, before: bool) -> Callable[[Journal, Entry], None]:
    """`Journal.add` that is interrupted at every so-manieth entry."""
    original, count = Journal.add, 0

    def add(self: Journal, entry: Entry) -> None:
        nonlocal count
        count += 1
        if before and count % every == 0:
            raise KeyboardInterrupt
        original(self, entry)
        if not before and count % every == 0:
            raise KeyboardInterrupt

    return add


@pytest.mark.slow
@pytest.mark.parametrize(
    ("every", "when"), [(2, "before"), (3, "before"), (1, "after"), (4, "after")]
)
def test_interruptions_leave_no_trace(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch, every: int, when: str
) -> None:
    """Whatever was going on: a run, an epoch, the end of a phase or of a round."""
    laboratory.change("validation: {runs: 2}", "validation: {runs: 2, drives: 2}")
    whole = laboratory.train("whole")
    expected = laboratory.checkpoint
    (laboratory.folder / "toy.safetensors").unlink()
    monkeypatch.setattr(Journal, "add", interrupting(every, before=when == "before"))
    sessions, found = 0, None
    while found is None:
        assert not (laboratory.folder / "toy.safetensors").exists()
        sessions += 1
        with contextlib.suppress(Interrupted):
            found = laboratory.train("parts", resume=sessions > 1)
    assert sessions > 5
    assert laboratory.checkpoint == expected
    assert without_times(found.findings.epochs) == without_times(whole.findings.epochs)
    assert without_times(found.findings.phases) == without_times(whole.findings.phases)
    provenance = json.loads((laboratory.folder / "parts" / "provenance.json").read_text())
    assert len(provenance["sessions"]) == sessions


@pytest.mark.parametrize("kind", [Run, Epoch])
def test_an_interruption_that_falls_into_a_destructor_is_not_lost(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch, kind: type[Entry]
) -> None:
    ignored = record_ignored(monkeypatch)
    original = Journal.add
    added: list[Entry] = []

    def add(self: Journal, entry: Entry) -> None:
        added.append(entry)
        if isinstance(entry, kind):
            InterruptedDestructor()
        original(self, entry)

    monkeypatch.setattr(Journal, "add", add)
    with stopping() as stop, pytest.raises(Interrupted):
        laboratory.train(check=stop.check)
    assert ignored == [KeyboardInterrupt]
    assert [isinstance(each, kind) for each in added].index(True) == len(added) - 1


def test_taking_in_runs_can_be_interrupted(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between two runs; what was taken in is taken in again, and the network is the same."""
    laboratory.train("whole")
    expected = laboratory.checkpoint
    taken = 0
    original = Rollouts.recorded

    def recorded(self: Rollouts, phase: Phase) -> Iterator[RecordedRun]:
        nonlocal taken
        for run in original(self, phase):
            taken += 1
            yield run

    def check() -> None:
        if taken == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(Rollouts, "recorded", recorded)
    with pytest.raises(Interrupted):
        laboratory.train("parts", check=check)
    assert taken == 3
    laboratory.train("parts", resume=True)
    assert laboratory.checkpoint == expected


def test_a_sudden_end_amid_a_line_costs_that_line_only(laboratory: Laboratory) -> None:
    laboratory.train("whole")
    expected = laboratory.checkpoint
    journal = laboratory.folder / "whole" / ENTRIES
    lines = journal.read_text().splitlines(keepends=True)
    cut = next(k for k, line in enumerate(lines) if '"round": 1, "epoch": 3' in line)
    journal.write_text("".join(lines[:cut]) + lines[cut][:20])
    laboratory.workers.done.clear()
    with pytest.raises(LearningError, match=r"round-1-epoch-2 cannot be read: No such file"):
        laboratory.train("whole", resume=True)  # the state of epoch 2 was tidied away since
    journal.write_text("".join(lines[: cut - 2]) + lines[cut][:20])
    laboratory.train("whole", resume=True)
    assert laboratory.checkpoint == expected


def test_the_network_becomes_the_expert(laboratory: Laboratory) -> None:
    laboratory.change("epochs: 6", "epochs: 60")
    laboratory.train()
    assert laboratory.checkpoint["gain"] == pytest.approx(GAIN, abs=0.02)
    assert laboratory.checkpoint["offset"] == pytest.approx(0.0, abs=0.02)


def test_who_drives(laboratory: Laboratory) -> None:
    """The expert first, then the network of the round before, corrected less and less."""
    laboratory.train()
    out = laboratory.folder / "out"
    drivers = [
        {
            name: json.loads(text)
            for text in work.overrides
            for name, _, text in [text.partition("=")]
        }
        for work in laboratory.workers.done
    ]
    name, beta = (f"components.policy.parameters.{each}" for each in ("network", "beta"))
    assert [(each[name], each[beta]) for each in drivers] == [
        *[("", 1.0)] * 6,
        *[(str(out / "rounds" / "round-0.safetensors"), 0.5)] * 3,
        *[(str(out / "rounds" / "round-1.safetensors"), 0.25)] * 3,
    ]
    assert len({each["seed"] for each in drivers}) == 12


def test_all_that_use_the_network_get_the_same(laboratory: Laboratory) -> None:
    """Who shares must encode by the network that the policy decodes by."""
    companion = (
        "components:\n  car: {type: toy-companion, step: 100 ms, parameters: {network: old}}"
    )
    laboratory.change("components:", companion, "ball.yaml")
    laboratory.train()
    for work in laboratory.workers.done:
        given = {
            text.rpartition("=")[2]
            for text in work.overrides
            if text.partition("=")[0].endswith(".network")
        }
        assert len(given) == 1
        assert any(text.startswith("components.car.parameters.network=") for text in work.overrides)


def test_the_best_epoch_is_kept(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Epochs 1, 2, ... have these validation losses; patience 2 ends the round after the fifth."""
    losses = iter([3.0, 2.0, 1.0, 1.0, 1.5])
    weights = []

    def epoch(self: Line) -> EpochResult:
        self._weights = self._rng.normal(size=2)
        weights.append(self._weights.tolist())
        return EpochResult(training=0.5, validation=next(losses))

    monkeypatch.setattr(Line, "epoch", epoch)
    laboratory.change("rounds: 2", "rounds: 0")
    found = laboratory.train()
    assert [row["kept"] for row in found.findings.epochs] == [False, False, True, False, False]
    assert [laboratory.checkpoint["gain"], laboratory.checkpoint["offset"]] == weights[2]
    assert [p.name for p in (laboratory.folder / "out" / "states").iterdir()] == ["round-0-epoch-3"]


def test_a_round_begins_where_the_best_epoch_before_was(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = []
    original = Line.begin_round

    def begin_round(self: Line, number: int) -> None:
        begun.append(self._weights.tolist())
        original(self, number)

    monkeypatch.setattr(Line, "begin_round", begin_round)
    laboratory.change("rate: 0.05", "rate: 0.9")  # losses rise
    laboratory.train()
    for number in (0, 1):
        path = laboratory.folder / "out" / "rounds" / f"round-{number}.safetensors"
        assert list(json.loads(path.read_text()).values()) == begun[number + 1]


@pytest.mark.parametrize(
    ("ends", "chosen"),
    [
        ([(0.2, 0.8), (0.1, 0.9), (0.3, 0.7)], 1),
        ([(0.1, 0.9), (0.0, 0.0), (0.2, 0.5)], 0),  # who never moves does not collide
        ([(0.4, 0.5), (0.3, 0.5), (0.4, 0.5)], 1),
        ([(0.1, 0.9), (0.2, 0.8), (0.1, 0.9)], 2),  # of equal ones the later
    ],
)
def test_the_round_that_drives_best_is_chosen(
    laboratory: Laboratory,
    monkeypatch: pytest.MonkeyPatch,
    ends: list[tuple[float, float]],
    chosen: int,
) -> None:
    """Rounds end so often in collisions, so often in success; ten drives each."""
    laboratory.change("validation: {runs: 2}", "validation: {runs: 10, drives: 10}")
    monkeypatch.setattr(Fall, "metrics", lambda self, recording: _ends(recording, ends))
    found = laboratory.train()
    drives = [row for row in found.findings.phases if row["phase"].startswith("drive")]
    assert [row["driver"] for row in drives] == ["round 0", "round 1", "round 2"]
    assert [(row["collision"], row["success"]) for row in drives] == ends
    assert found.findings.chosen == chosen
    network = laboratory.folder / "out" / "rounds" / f"round-{chosen}.safetensors"
    assert json.loads(network.read_text()) == laboratory.checkpoint


def _ends(recording: Recording, ends: list[tuple[float, float]]) -> dict[str, bool]:
    """How a run ends, of ten drives with consecutive seeds so many one way and the other."""
    network = recording.manifest["scenario"]["components"]["policy"]["parameters"]["network"]
    if not network:
        return {"collision": False, "success": True}
    collisions, successes = ends[int(network.removesuffix(".safetensors")[-1])]
    place = recording.manifest["seed"] % 10
    return {"collision": place >= 10 - round(10 * collisions), "success": place < 10 * successes}


def test_another_seed_is_another_training(laboratory: Laboratory) -> None:
    laboratory.train("one")
    one = laboratory.checkpoint
    laboratory.train("again")
    assert laboratory.checkpoint == one
    laboratory.train("two", seed=8)
    assert laboratory.checkpoint != one


def test_rounds_can_be_added(laboratory: Laboratory) -> None:
    laboratory.train("all")
    expected = laboratory.checkpoint
    laboratory.change("rounds: 2", "rounds: 1")
    laboratory.train()
    assert laboratory.checkpoint != expected
    laboratory.change("rounds: 1", "rounds: 2")
    laboratory.workers.done.clear()
    laboratory.train(resume=True)
    assert laboratory.checkpoint == expected
    assert len(laboratory.workers.done) == 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed: 7", "seed: 8", "another training: `seed` changed since"),
        ("rate: 0.05", "rate: 0.06", "`optimisation` changed since; only rounds may be added"),
        ("parameters.wind: 1.0", "parameters.wind: 2.0", "`scenes` changed since"),
        ("rounds: 2", "rounds: 1", "holds 2 rounds of DAgger; the file has 1 now"),
    ],
)
def test_another_training_is_not_resumed(
    laboratory: Laboratory, old: str, new: str, message: str
) -> None:
    laboratory.train()
    laboratory.change(old, new)
    with pytest.raises(ResumeError, match=message):
        laboratory.train(resume=True)


def test_no_training_is_not_resumed(laboratory: Laboratory) -> None:
    with pytest.raises(ResumeError, match="holds no training to resume; leave `--resume` out"):
        laboratory.train(resume=True)


def test_two_commits_are_remarked_upon(
    laboratory: Laboratory, caplog: pytest.LogCaptureFixture
) -> None:
    laboratory.train()
    path = laboratory.folder / "out" / "provenance.json"
    content = json.loads(path.read_text())
    content["sessions"][0] |= {"commit": "0123456789ab", "device": "cuda"}
    path.write_text(json.dumps(content))
    laboratory.train(resume=True)
    assert "was begun with the commit 0123456789ab; going on with" in caplog.text
    assert "was begun with the device cuda; going on with cpu" in caplog.text


def test_only_samples_and_networks_are_left(laboratory: Laboratory) -> None:
    laboratory.train()
    out = laboratory.folder / "out"
    assert {path.name for path in out.iterdir()} == {
        *("training.json", "provenance.json", "journal.jsonl", "log.txt", "summary.txt"),
        *("training.csv", "phases.csv", "samples", "rounds", "states"),
    }
    assert len(list((out / "samples").iterdir())) == 12


def test_a_loss_that_is_no_number_ends_it(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = EpochResult(training=0.1, validation=math.nan)
    monkeypatch.setattr(Line, "epoch", lambda self: result)
    with pytest.raises(LearningError, match=r"`validation_loss` is nan after epoch 1 of round 0"):
        laboratory.train()


def test_samples_of_another_learner(laboratory: Laboratory, tmp_path: Path) -> None:
    def refuse(self: Line, runs: object) -> None:
        raise ValueError("a sample has not two numbers")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Line, "add", refuse)
        with pytest.raises(
            LearningError, match="the phase `expert` cannot be learned from: a samp"
        ):
            laboratory.train()
