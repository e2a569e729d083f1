"""Fixtures of the tests of training: a laboratory whose workers are this very process."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator import registry, report
from orchestrator.campaign.conduct import Options
from studies.training import figure, learner
from studies.training.collection import Collection
from studies.training.conduct import TrainingOutcome, conduct_training
from studies.training.load import load_training
from tests.installation import install
from tests.studies.training import toys
from tests.workers import HereAndNow

TOYS = {
    registry.COMPONENTS: {
        "toy-policy": "tests.studies.training.toys:Policy",
        "toy-plain-policy": "tests.studies.training.toys:PlainPolicy",
        "toy-companion": "tests.studies.training.toys:Companion",
        "toy-bystander": "tests.studies.training.toys:Bystander",
    },
    report.GROUP: {"toy-report": "tests.studies.training.toys:Fall"},
    learner.GROUP: {
        "toy-learner": "tests.studies.training.toys:Line",
        "toy-policy": "tests.studies.training.toys:Policy",
        "lacking": "tests.studies.training.lacking:Learner",
    },
}


class Laboratory:
    """A folder with a training file and its scenario."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "training.yaml"
        self.file.write_text(toys.TRAINING)
        (folder / "ball.yaml").write_text(toys.SCENARIO)
        self.workers = HereAndNow()

    @property
    def checkpoint(self) -> dict[str, float]:
        """The network that came out."""
        found: dict[str, float] = json.loads((self.folder / "toy.safetensors").read_text())
        return found

    def change(self, old: str, new: str, name: str = "training.yaml") -> None:
        path = self.folder / name
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    def options(
        self,
        out: str = "out",
        *,
        resume: bool = False,
        check: Callable[[], None] = lambda: None,
    ) -> Options:
        """How to conduct a training in a folder of the laboratory."""
        return Options(
            out=self.folder / out,
            pool=self.workers.pool,
            resume=resume,
            progress=False,
            command="nlosim train training.yaml",
            check=check,
        )

    def train(
        self,
        out: str = "out",
        *,
        resume: bool = False,
        check: Callable[[], None] = lambda: None,
        collection: Collection | None = None,
        **changes: Any,
    ) -> TrainingOutcome:
        options = self.options(out, resume=resume, check=check)
        return conduct_training(replace(load_training(self.file), **changes), options, collection)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install the toys, and nothing else."""
    install(monkeypatch, TOYS)


@pytest.fixture
def laboratory(tmp_path: Path, installed: None, monkeypatch: pytest.MonkeyPatch) -> Laboratory:
    """Without figures, which take longer than all else; `test_training_results` draws them."""
    monkeypatch.setattr(figure, "draw", lambda found, directory: None)
    return Laboratory(tmp_path)
