"""What an experiment is made of: combinations of levels, seeds, and the runs of both."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from orchestrator.campaign.work import RunKey
from orchestrator.scenario.document import Document
from orchestrator.wording import Openly, Privately, Wording


@dataclass(frozen=True, slots=True)
class Combination:
    """One level of every factor.

    Attributes:
        levels: by factor.
        overrides: `PATH=VALUE`, as `nlosim run --set` takes them; those of `set` first.
        resolved: the scenario that they make, the seed left out.
    """

    levels: Mapping[str, str]
    overrides: tuple[str, ...]
    resolved: Mapping[str, Any] = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportPlan:
    """The report that an experiment wants.

    Attributes:
        name: of an installed report.
        parameters: as the experiment file has them.
    """

    name: str
    parameters: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """An experiment file that was read and checked.

    Attributes:
        path: of the experiment file.
        scenario: the absolute path of the scenario file.
        seeds: of every combination.
        combinations: all that are not skipped; the last factor varies fastest.
        metrics: for each column its path in the metrics of a run.
        report: over all runs, if there is one.
        transport: how components in processes of their own are reached; `None`: as their marks say.
        hosts: the absolute path of the hosts file; `None`: all components are here.
        remarks: what is not wrong, but may not be meant.
        private: whether files of results say nothing of this host and its folders.
        document: where everything was written.
    """

    path: Path
    scenario: Path
    seeds: tuple[int, ...]
    combinations: tuple[Combination, ...]
    metrics: Mapping[str, str]
    report: ReportPlan | None
    transport: str | None = None
    hosts: Path | None = None
    remarks: tuple[str, ...] = ()
    private: bool = False
    document: Document = field(repr=False, compare=False)

    @property
    def wording(self) -> Wording:
        """How files of results are written down."""
        near = (self.path.absolute().parent, self.scenario.parent)
        return Privately(*near) if self.private else Openly()

    @property
    def factors(self) -> tuple[str, ...]:
        """Their names, in the order of the file."""
        return tuple(self.combinations[0].levels)

    @property
    def levels(self) -> Mapping[str, tuple[str, ...]]:
        """The levels of each factor that are run, in the order of the file."""
        return {
            factor: tuple(dict.fromkeys(c.levels[factor] for c in self.combinations))
            for factor in self.factors
        }

    def runs(self) -> list[RunKey]:
        """All runs, seed by seed: an interrupted experiment has seen all combinations alike."""
        indices = range(len(self.combinations))
        return [RunKey(seed, index) for seed in self.seeds for index in indices]

    def command(self, key: RunKey) -> str:
        """The shell command that repeats a run."""
        words = ["nlosim", "run", str(self.scenario), "--seed", str(key.seed)]
        words += [] if self.transport is None else ["--transport", self.transport]
        words += [] if self.hosts is None else ["--hosts", str(self.hosts)]
        for override in self.combinations[key.combination].overrides:
            words += ["--set", override]
        return shlex.join(words)

    def name(self, key: RunKey) -> str:
        """Seed and levels of a run, for people."""
        levels = self.combinations[key.combination].levels
        return ", ".join([f"seed {key.seed}", *(f"{f} {level}" for f, level in levels.items())])
