"""Runs of the expert, kept for every training that needs the same ones.

What the expert teaches does not depend on the network that learns it. A run is known by what
decides on it: the scenario as it was resolved, levels and seed included, its input files, the
sources of the simulation, and the versions of what it is made of.

KEY.npz   the samples, as `studies.training.samples` writes them
KEY.json  what became of the run
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Final

from orchestrator.campaign.work import Result, Work
from orchestrator.provenance import provenance
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.inputs import digests
from studies.training import files

_ROOT: Final = Path(__file__).parents[2]
_SOURCES: Final = ("orchestrator", "adapters", "fmus", "studies/training", "pyproject.toml")
"""What decides on a run, but for the learners and what merely conducts."""
_SUFFIXES: Final = frozenset({".py", ".c", ".h", ".toml"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """A run that was driven before.

    Attributes:
        samples: the file of them.
        count: how many there are.
        result: what became of it.
    """

    samples: Path
    count: int
    result: Result


@dataclass(frozen=True, slots=True)
class Collection:
    """A folder of runs, which several trainings may use at a time.

    Args:
        directory: it is made where it is missing.
    """

    directory: Path

    def key(self, work: Work) -> str:
        """SHA-256 of everything that decides on a run, hexadecimal.

        Args:
            work: the run, its seed among the overrides.

        Raises:
            ScenarioError: the scenario cannot be loaded.
        """
        scenario = load_scenario(Path(work.scenario), work.overrides)
        what = {
            "scenario": scenario.resolved(),
            "files": digests(scenario),
            "versions": provenance()["versions"],
            "sources": _sources(),
        }
        text = json.dumps(what, sort_keys=True, ensure_ascii=False)
        # wherever the scenarios are, and the FMUs that come with them
        for where, name in ((scenario.path.parent.resolve(), "."), (_ROOT, "nlosim")):
            text = text.replace(str(where), name)
        return hashlib.sha256(text.encode()).hexdigest()

    def find(self, key: str) -> Stored | None:
        """The run with this key, if there is one."""
        try:
            content = json.loads(self._path(key, "json").read_text(encoding="utf-8"))
            stored = Stored(
                samples=self._path(key, "npz"),
                count=content["samples"],
                result=Result(**content["result"]),
            )
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return stored if stored.samples.is_file() else None

    def keep(self, key: str, samples: Path, count: int, result: Result) -> None:
        """Keep a run that did not fail; when this returns, it is on the disk.

        Args:
            key: of the run.
            samples: the file of its samples, which is copied.
            count: how many they are.
            result: what became of it.
        """
        self.directory.mkdir(parents=True, exist_ok=True)
        files.write(self._path(key, "npz"), samples.read_bytes())
        content = {"samples": count, "result": asdict(result)}
        files.write(self._path(key, "json"), json.dumps(content).encode())

    def _path(self, key: str, kind: str) -> Path:
        return self.directory / f"{key}.{kind}"


@cache
def _sources() -> str:
    """SHA-256 of the sources of the simulation, hexadecimal."""
    digest = hashlib.sha256()
    for path in _source_files():
        digest.update(f"{path.relative_to(_ROOT)}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _source_files() -> Iterator[Path]:
    for name in _SOURCES:
        start = _ROOT / name
        found = [start] if start.is_file() else sorted(start.rglob("*"))
        yield from (path for path in found if path.suffix in _SUFFIXES)
