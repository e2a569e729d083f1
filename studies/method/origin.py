"""Where the numbers of a study come from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from orchestrator.experiment.report import Results

_VERSIONS: Final = ("nlosim", "python", "numpy", "libsumo", "matplotlib", "distributed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """The machine that ran an experiment, without its name; `None` where that is not known.

    Attributes:
        cpu: the name of its processor.
        cpus: how many processors the process could use.
        memory_gib: its memory [GiB].
        platform: its operating system.
    """

    cpu: str | None
    cpus: int | None
    memory_gib: float | None
    platform: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Session:
    """The first start of an experiment, or a later one that went on with it.

    Attributes:
        command: the command line.
        created: when it was started (ISO 8601).
        commit: the commit of the checkout; `None` outside of one.
        versions: the versions of the packages that the numbers may depend on.
        machine: the machine that ran it.
    """

    command: str
    created: str
    commit: str | None
    versions: Mapping[str, str]
    machine: Machine


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """Everything that a reader needs to make the numbers of an experiment again.

    Attributes:
        experiment: the path of the experiment file.
        seeds: the seeds of every combination, as an experiment file has them.
        planned: the number of runs that the experiment has.
        runs: the number of runs that are there.
        failed: the number of those that failed.
        sessions: all starts of the experiment.
    """

    experiment: str
    seeds: str
    planned: int
    runs: int
    failed: int
    sessions: tuple[Session, ...]


def origin(results: Results) -> Origin:
    """Say where `results` come from, without the name of a host."""
    return Origin(
        experiment=str(results.experiment.path),
        seeds=seeds_text(results.experiment.seeds),
        planned=len(results.experiment.runs()),
        runs=len(results.rows),
        failed=sum(row["error"] is not None for row in results.rows),
        sessions=tuple(session_of(session) for session in results.sessions),
    )


def seeds_text(seeds: Sequence[int]) -> str:
    """The seeds as an experiment file has them: a range if they are one."""
    if len(seeds) > 1 and list(seeds) == list(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]}..{seeds[-1]}"
    return ", ".join(map(str, seeds))


def session_of(session: Mapping[str, Any]) -> Session:
    """A start of an experiment as `experiment.json` has it, without the name of the host."""
    host, versions = session["host"], session["versions"]
    return Session(
        command=session["command"],
        created=session["created"],
        commit=session["commit"],
        versions={name: versions[name] for name in _VERSIONS if name in versions},
        machine=Machine(
            cpu=host.get("cpu"),
            cpus=host.get("cpus"),
            memory_gib=host.get("memory_gib"),
            platform=host.get("platform"),
        ),
    )
