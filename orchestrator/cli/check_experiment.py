"""`nlosim check` of an experiment file."""

from argparse import Namespace
from pathlib import Path

from orchestrator.cli.failures import problem_data
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.cli.streams import tell_line as tell
from orchestrator.errors import CosimError, ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.hosts_file import read_hosts
from orchestrator.scenario import extension
from orchestrator.scenario.other_files import is_experiment


def is_one(path: Path) -> bool:
    """Whether there is an experiment at `path`; whatever cannot be read is none."""
    try:
        return is_experiment(extension.read(path))
    except ScenarioError:
        return False


def execute(arguments: Namespace, path: Path) -> Outcome:
    """Find every problem of the experiment and of its scenario with every combination of levels.

    Raises:
        CosimError: an option is for scenarios only.
    """
    if arguments.overrides:
        raise CosimError("an experiment takes no --set; write what all runs share under its `set`")
    if arguments.checkpoint is not None:
        raise CosimError("an experiment takes no --checkpoint; its runs are begun anew")
    hosts = None if arguments.hosts is None else read_hosts(Path(arguments.hosts))
    try:
        experiment = load_experiment(path, hosts=hosts, tell=tell)
    except ScenarioError as error:
        return Outcome(
            text="\n".join(map(str, error.problems)),
            data={"problems": [problem_data(problem) for problem in error.problems]},
            exit_code=Exit.WRONG_INPUT,
        )
    combinations, seeds = len(experiment.combinations), len(experiment.seeds)
    runs = combinations * seeds
    size = ", ".join(
        (_count(combinations, "combination"), _count(seeds, "seed"), _count(runs, "run"))
    )
    lines = [
        *(f"{remark} (a remark)" for remark in experiment.remarks),
        f"{arguments.scenario}: ok, an experiment, {size}",
    ]
    remarks = {"remarks": list(experiment.remarks)} if experiment.remarks else {}
    data = {"problems": [], "combinations": combinations, "seeds": seeds, "runs": runs, **remarks}
    return Outcome(text="\n".join(lines), data=data)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
