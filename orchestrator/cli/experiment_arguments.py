"""The arguments of `nlosim experiment` and `nlosim report`."""

import argparse
from typing import Any, Final

from orchestrator.cli.command import command
from orchestrator.cli.rerun_arguments import PRIVATE

_REPORT: Final = """\
Of a run: writes metrics.json, measures/, measures.svg, the report's figure.png and the page
index.html, which any browser shows offline, into its directory. If the scenario does not speak of
measures, all are asked whose signals are recorded. Of an experiment, which may have been
interrupted: runs.parquet, summary.csv, the folder `report` of the experiment's report, and a page
index.html of all runs. Of several experiments: one page that joins them, --page FILE."""

_EXPERIMENT: Final = """\
The directory holds runs.parquet (one row per run), summary.csv (mean and 95 % interval per
combination of levels), report/ (what the report that the file names makes of them) and index.html,
a page of all runs that any browser shows offline. What is finished when Ctrl-C comes is kept;
--resume goes on. A run that fails is tried again, then reported with a command that repeats it.
See docs/experiments.md.

examples:
  nlosim experiment studies/red_light/experiments/red_light_methods.yaml
  nlosim experiment studies/red_light/experiments/red_light_methods.yaml --resume
  nlosim experiment methods.yaml --scheduler tcp://head-node:8786
  nlosim experiment methods.yaml --hosts hosts.yaml   # one run after the other"""


def add_report(commands: Any) -> None:
    """Add `nlosim report` to the subparsers."""
    report = command(
        commands, "report", "make tables and figures of a finished run or experiment again", _REPORT
    )
    report.add_argument("directory", metavar="DIR", nargs="+", help="of a run or an experiment")
    report.add_argument("--page", metavar="FILE", help="one page of several experiments")
    report.add_argument(
        "--measures",
        metavar="NAMES",
        help="of a run: measures to ask beside those of the scenario, e.g. `prr,ttc`;\n"
        "`all`: all whose signals are recorded",
    )
    report.add_argument(
        "--parquet", action="store_true", help="of a run: tables in Parquet files, too"
    )


def add_experiment(commands: Any) -> argparse.ArgumentParser:
    """Add `nlosim experiment` to the subparsers, and return its parser."""
    experiment: argparse.ArgumentParser = command(
        commands, "experiment", "run a scenario with many seeds and settings", _EXPERIMENT
    )
    experiment.add_argument("experiment", metavar="FILE", help="an experiment file (YAML)")
    experiment.add_argument(
        "--out",
        metavar="DIR",
        help="the directory of the results (default: runs/EXPERIMENT, numbered if it exists)",
    )
    experiment.add_argument(
        "--seeds",
        metavar="SEEDS",
        help="instead of the file's: how many, or a range such as 1..5",
    )
    experiment.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: one per core)"
    )
    experiment.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask scheduler, instead of own processes"
    )
    experiment.add_argument(
        "--transport",
        metavar="NAME",
        help="of every run, as of `nlosim run`; results are the same, also with --resume",
    )
    experiment.add_argument("--resume", action="store_true", help="go on with what is in --out")
    experiment.add_argument("--keep-runs", action="store_true", help="keep all run directories")
    experiment.add_argument("--private", action="store_true", help=PRIVATE)
    experiment.add_argument("--no-page", action="store_true", help="do not write index.html")
    experiment.add_argument("--quiet", action="store_true", help="no progress bar")
    return experiment
