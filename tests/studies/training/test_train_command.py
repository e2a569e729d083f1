"""`nlosim train` as users start it: workers, Ctrl-C, exit codes, JSON."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from orchestrator.campaign import workers
from orchestrator.cli import main
from studies.training import train
from studies.training.journal import ENTRIES
from tests.full_disk import DiskFillsUp, files_as_before
from tests.installation import site
from tests.studies.training import toys
from tests.studies.training.conftest import TOYS, Laboratory
from tests.workers import workers_here

pytest.importorskip("distributed", reason="needs the extra `train`")

ROOT = Path(__file__).parents[3]


class Shell:
    """A folder with a training file, and an environment in which the toys are installed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "training.yaml").write_text(toys.TRAINING)
        (folder / "ball.yaml").write_text(toys.SCENARIO)
        (folder / "tmp").mkdir()
        path = f"{site(folder, 'toys', TOYS)}:{ROOT}"
        self.environment = {**os.environ, "PYTHONPATH": path, "TMPDIR": str(folder / "tmp")}

    def start(self, *options: str) -> "subprocess.Popen[str]":
        command = [sys.executable, "-m", "orchestrator", "train", "training.yaml", *options]
        return subprocess.Popen(
            command,
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, *options: str, code: int = 0) -> dict[str, Any]:
        """The JSON object of the command, which leaves nothing in the temporary directory."""
        process = self.start("--json", *options)
        output, errors = process.communicate(timeout=120)
        assert process.returncode == code, errors
        assert list((self.folder / "tmp").iterdir()) == []
        content: dict[str, Any] = json.loads(output)
        return content

    def change(self, old: str, new: str) -> None:
        path = self.folder / "training.yaml"
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))


@pytest.fixture
def shell(tmp_path: Path) -> Shell:
    return Shell(tmp_path)


Here = Callable[..., dict[str, Any]]
"""Trains by the command in this process, which performs the runs, too; see `Shell.run`."""


@pytest.fixture
def here(
    shell: Shell,
    installed: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Here:
    monkeypatch.chdir(shell.folder)
    monkeypatch.setattr(workers, "local_workers", workers_here)

    def run(*options: str, code: int = 0) -> dict[str, Any]:
        capsys.readouterr()
        assert main(["train", "training.yaml", "--json", *options]) == code
        content: dict[str, Any] = json.loads(capsys.readouterr().out)
        return content

    return run


@pytest.mark.slow
def test_ctrl_c_and_on_with_other_workers(shell: Shell, here: Here) -> None:
    """The network of two workers, interrupted while driving, is that of one, uninterrupted."""
    shell.change("expert: {runs: 4}", "expert: {runs: 40}")
    whole = here("--out", "whole", "--checkpoint", "whole.safetensors")
    process = shell.start("--out", "parts", "--cache", "kept", "--workers", "2")
    journal = shell.folder / "parts" / ENTRIES
    while not (journal.exists() and journal.read_text().count("\n") >= 5):
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 4
    assert "Traceback" not in errors
    assert errors.splitlines() == [
        "interrupted; what was done is in parts",
        "go on with: nlosim train training.yaml --out parts --cache kept --workers 2 --resume",
    ]
    assert list((shell.folder / "tmp").iterdir()) == []
    parts = shell.run("--out", "parts", "--resume", "--workers", "2")
    assert parts["checkpoint"] == str(shell.folder / "toy.safetensors")
    networks = [(shell.folder / f"{name}.safetensors").read_text() for name in ("whole", "toy")]
    assert networks[0] == networks[1]
    assert [e["validation_loss"] for e in parts["tables"]["epochs"]] == [
        e["validation_loss"] for e in whole["tables"]["epochs"]
    ]
    assert {"training.svg", "training.png", "training.csv"} <= {
        path.name for path in (shell.folder / "parts").iterdir()
    }


@pytest.mark.slow
def test_runs_that_fail(shell: Shell, here: Here) -> None:
    """All of them: the command that repeats one fails, too; none after that, and it goes on."""
    scenario = shell.folder / "ball.yaml"
    scenario.write_text(
        toys.SCENARIO.replace(
            "step: 100 ms",
            "step: 100 ms, parameters: {fails: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]}",
        )
    )
    error = here("--out", "out", code=3)["error"]
    assert (
        "2 of 2 runs of the phase `validation` failed, the first with: component"
        in (error["message"])
    )
    assert len(error["failed"]) == 6  # validation and expert
    command = shlex.split(error["failed"][0]["command"])
    again = subprocess.run(
        [sys.executable, "-m", "orchestrator", *command[1:]],
        cwd=shell.folder,
        env=shell.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (again.returncode, "the ball burst" in again.stderr) == (3, True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--resume"], "--resume needs --out DIR"),
        (["--workers", "0"], "--workers must be at least 1, got 0"),
        (["--seed", "-1"], "--seed: expected a whole number from 0 on, got '-1'"),
        (["--seeds", "1..3"], "--seeds needs --out DIR, the directory of all trainings"),
        (["--seeds", "1..3", "--seed", "1"], "--seed and --seeds exclude each other"),
        (["--seeds", "three", "--out", "x"], "--seeds: expected a number of seeds, a range"),
        (["--seeds", "[1]", "--out", "x"], "--seeds: expected a number of seeds, a range"),
        (["--seeds", "999999..1000001", "--out", "x"], "must be at most 1000000, got 1000001"),
        (["--device", "gpu"], "argument --device: invalid choice: 'gpu'"),
    ],
)
def test_options_that_make_no_sense(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", "absent.yaml", *options]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="there is no folder that takes no file")
def test_a_place_that_takes_no_network_is_refused_before_anything_is_driven(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whoever is root may write everywhere but there."""
    monkeypatch.chdir(laboratory.folder)
    command = ["train", "training.yaml", "--out", "o"]
    assert main([*command, "--checkpoint", "/proc/x.safetensors"]) == 2
    message = "error: the network cannot be written to `/proc/x.safetensors`: No such file or "
    assert message in capsys.readouterr().err
    assert not (laboratory.folder / "o").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="files of limited size stand for a full disk")
@pytest.mark.parametrize(
    ("options", "journal"),
    [((), Path("o", ENTRIES)), (("--seeds", "1..1"), Path("o/seed-1", ENTRIES))],
)
def test_a_full_disk_stops_a_training_that_goes_on_when_there_is_room(
    options: Sequence[str],
    journal: Path,
    laboratory: Laboratory,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The same network comes out as without; what is finished is not driven again."""
    monkeypatch.chdir(laboratory.folder)
    monkeypatch.setattr(train, "local_pool", lambda *_: laboratory.workers.pool())
    assert main(["train", "training.yaml", *options, "--out", "whole", "--quiet"]) == 0
    whole, driven = laboratory.checkpoint, len(laboratory.workers.done)
    filled = DiskFillsUp(journal, after=3)
    command = ["train", "training.yaml", *options, "--out", "o"]
    capsys.readouterr()
    with monkeypatch.context() as context, files_as_before():
        context.setattr(train, "local_pool", lambda *_: filled.pool())
        assert main([*command, "--quiet"]) == 2
    assert capsys.readouterr().err == (
        "error: File too large\nwhat is finished is in o; once the cause is mended, "
        f"go on with: nlosim {' '.join(command)} --resume\n"
    )
    assert main([*command, "--quiet", "--resume"]) == 0
    assert laboratory.checkpoint == whole
    assert len(laboratory.workers.done) == 2 * driven - 2


def test_several_seeds_share_the_runs_of_the_expert(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of validation, too; with a seed of their own they are the same for all."""
    monkeypatch.setattr(train, "local_pool", lambda *_: laboratory.workers.pool())
    monkeypatch.chdir(laboratory.folder)
    laboratory.change("expert: {runs: 4}", "expert: {runs: 4, seed: 5}")
    laboratory.change("validation: {runs: 2}", "validation: {runs: 2, drives: 2}")
    command = ["train", "training.yaml", "--seeds", "1..2", "--cache", "kept", "--out", "all"]
    assert main([*command, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each["seed"] for each in found["seeds"]] == [1, 2]
    assert len(list((laboratory.folder / "kept").glob("*.npz"))) == 6
    networks = [Path(each["checkpoint"]) for each in found["seeds"]]
    assert networks[0] == laboratory.folder / "toy.safetensors"
    assert networks[1].parts[-2:] == ("seed-2", "toy.safetensors")
    assert networks[0].read_bytes() != networks[1].read_bytes()
    table = (laboratory.folder / "all" / "spread.csv").read_text()
    assert table.startswith("encounter,held_out,seeds,")
    assert main([*command, "--resume"]) == 0
    text = capsys.readouterr().out
    assert [line for line in text.splitlines() if line.startswith("seed ")] == ["seed 1", "seed 2"]
    assert "seeds.csv and spread.csv in all have what differs between the seeds" in text
