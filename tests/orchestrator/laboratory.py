"""A folder with an experiment, run in this process or in processes of its own."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from typing_extensions import override

from orchestrator import registry
from orchestrator.campaign import workers
from orchestrator.cli import main
from orchestrator.experiment.journal import RUNS as JOURNAL
from orchestrator.experiment.tables import TIMES
from tests.installation import install, site
from tests.orchestrator.conftest import SAMPLE_UNITS, TWO_UNITS
from tests.workers import workers_here

ROOT = Path(__file__).parents[2]
PACKAGES = Path(__file__).parent / "packages"

SCENARIO = TWO_UNITS.replace("components:", "components:\n  fate: {type: mortal, step: 1 s}")
FILE = """\
schema: 1
scenario: two.yaml
seeds: 3
set: {report: trace}
factors:
  noise:
    noisy: {components.car.parameters.noisy: true}
    exact: {components.car.parameters.noisy: false}
metrics: {distance: distance_m, samples: samples}
"""
UNITS = {
    **SAMPLE_UNITS,
    registry.COMPONENTS: {
        **SAMPLE_UNITS[registry.COMPONENTS],
        "mortal": "experiment_units:Mortal",
    },
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """What a command did: its exit code, and what it wrote to standard output and error."""

    code: int
    output: str
    errors: str


class Executing(ABC):
    """How `nlosim` is executed, its components installed, with `tmp` for temporary files."""

    @abstractmethod
    def __call__(self, arguments: list[str]) -> Done:
        """Execute it, and wait for its end."""


class Here(Executing):
    """In this process, the runs too: what an experiment does besides distributing them."""

    def __init__(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        (folder / "tmp").mkdir(exist_ok=True)
        self._capsys = capsys
        monkeypatch.setattr(tempfile, "tempdir", str(folder / "tmp"))
        monkeypatch.setattr(workers, "local_workers", workers_here)
        monkeypatch.setenv("NLOSIM_THREADS", "1")  # which `perform` would set for all tests to come
        monkeypatch.syspath_prepend(PACKAGES)
        install(monkeypatch, UNITS)

    @override
    def __call__(self, arguments: list[str]) -> Done:
        self._capsys.readouterr()
        code = main(arguments)
        output, errors = self._capsys.readouterr()
        return Done(code=code, output=output, errors=errors)


class Program(Executing):
    """In a process of its own, with workers by Dask."""

    def __init__(self, folder: Path) -> None:
        (folder / "tmp").mkdir(exist_ok=True)
        self._installed = site(folder, "sample-units", UNITS)
        self.environment = {
            **os.environ,
            "PYTHONPATH": f"{self._installed}:{PACKAGES}:{ROOT}",
            "TMPDIR": str(folder / "tmp"),
        }

    @override
    def __call__(self, arguments: list[str]) -> Done:
        done = subprocess.run(
            [sys.executable, "-m", "orchestrator", *arguments],
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        return Done(code=done.returncode, output=done.stdout, errors=done.stderr)

    def interrupted(self, arguments: list[str], is_time: Callable[[int], bool]) -> Done:
        """Send what Ctrl-C in a terminal sends, to all processes, as soon as it is time.

        Args:
            arguments: of the program.
            is_time: from its process id.
        """
        with subprocess.Popen(
            [sys.executable, "-m", "orchestrator", *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        ) as process:
            try:
                while not is_time(process.pid):
                    assert process.poll() is None
                    time.sleep(0.02)
                os.killpg(process.pid, signal.SIGINT)
                output, errors = process.communicate(timeout=60)
            except BaseException:
                process.kill()
                raise
        return Done(code=process.returncode, output=output, errors=errors)


class Laboratory:
    """A folder with an experiment, and what executes it."""

    def __init__(self, folder: Path, execute: Executing) -> None:
        self.folder = folder
        self.file = folder / "experiment.yaml"
        self.file.write_text(FILE)
        (folder / "two.yaml").write_text(SCENARIO)
        self.execute = execute

    def arguments(self, out: str, *options: str) -> list[str]:
        return ["experiment", str(self.file), "--json", "--out", str(self.folder / out), *options]

    def run(self, out: str, *options: str, code: int = 0) -> dict[str, Any]:
        """The JSON object of the command, which leaves nothing in the temporary directory."""
        return self.read(self.execute(self.arguments(out, *options)), code)

    def report(self, out: str, code: int = 0) -> dict[str, Any]:
        """The JSON object of `nlosim report`."""
        return self.read(self.execute(["report", str(self.folder / out), "--json"]), code)

    def read(self, done: Done, code: int) -> dict[str, Any]:
        """What the command wrote, which had to end with `code`."""
        assert done.code == code, done.errors
        content: dict[str, Any] = json.loads(done.output)
        # of a bug or a plug-in's failure there is a traceback, which is named
        if "log" in content.get("error", {}):
            Path(content["error"]["log"]).unlink()
        assert list((self.folder / "tmp").iterdir()) == []
        return content

    def journal(self, out: str) -> Path:
        return self.folder / out / JOURNAL

    def change(self, old: str, new: str) -> None:
        text = self.file.read_text()
        assert old in text
        self.file.write_text(text.replace(old, new))

    def rows(self, out: str) -> list[dict[str, Any]]:
        """The rows without what they cost."""
        table = pq.read_table(self.folder / out / "runs.parquet").drop_columns([*TIMES])
        found: list[dict[str, Any]] = table.to_pylist()
        return found

    def summary(self, out: str) -> bytes:
        return (self.folder / out / "summary.csv").read_bytes()
