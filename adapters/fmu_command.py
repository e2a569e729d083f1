"""`nlosim fmu ...`, found by the entry point group `orchestrator.commands`.

What the actions do is loaded when they are called. Packages add further ones by `ACTIONS`.
"""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import add_installed, command
from orchestrator.cli.outcome import Outcome
from orchestrator.installed import entry_points

ACTIONS: Final = "orchestrator.fmu_actions"
"""Entry points by name: a callable that adds parsers to the subparsers of `fmu`, each with the
default `execute`, a callable from the parsed arguments to an `Outcome`."""

KINDS: Final = ("co-simulation", "model-exchange", "scheduled-execution")
SOLVERS: Final = ("cvode", "dopri5", "rk4", "euler")

_INFO: Final = """\
Also of FMUs that cannot be run here: of another platform, of other versions, with broken rules.

  nlosim fmu info controller.fmu
  nlosim fmu info controller.fmu --json | jq '.variables[].name'
"""
_VALIDATE: Final = """\
Holds modelDescription.xml against the schemas and the rules of FMI 2.0.4 or 3.0.2, the archive
against what it may contain, and the binary for this machine against the functions that it has to
export. Every broken rule is told with line and column and where the standard says it; nothing of
the FMU is run. Exit code 1 if a rule is broken.

  nlosim fmu validate controller.fmu
  nlosim fmu validate *.fmu --json
"""
_RUN: Final = """\
Times that are not given are those of the default experiment of the FMU; without one, it is 1 s in
500 steps. Steps divide the time exactly; they may be fractions, such as 1/60. Inputs come from a
table with a column `time` and columns with the names of inputs (Reference FMUs: `_in.csv`): those
that are continuous are interpolated, others keep their last value; two rows with the same time are
a step. Inputs without a column keep their start values. Elements of an array stand in one field,
with spaces. The result has a row for every communication point. An FMU with both interfaces is run
by Co-Simulation; --kind model-exchange, or a --solver, has it integrated here: by cvode or dopri5
to --tolerance, or by rk4 or euler with the longest step --solver-step.

  nlosim fmu run controller.fmu --stop-time 10 --step 0.01 --output result.csv --plot result.svg
  nlosim fmu run controller.fmu --start-value gain=2 --input inputs.csv --plot -
  nlosim fmu run ball.fmu --solver cvode --tolerance 1e-8
  nlosim fmu run ball.fmu --solver euler --solver-step 1e-4
"""
_COMPARE: Final = """\
A result is a CSV or Parquet file with a column `time`, a run directory of nlosim, or an FMU, which
is run as `nlosim fmu run` does. Variables of the same name are compared at the times of the first
result that both have; numbers are interpolated, and converted where both headings have a unit,
`v [km/h]`. Columns of text are left out. They agree where their difference is at most ABSOLUTE +
RELATIVE times the largest value of the variable in the second result. Exit code 1 if one does not,
or if there is nothing to compare; of each variable the worst point is told, and where it was first
too far.

  nlosim fmu compare result.csv controller_ref.csv --whole
  nlosim fmu compare runs/a-1 runs/a-2 --relative 0
  nlosim fmu compare old.fmu new.fmu --relative 0
"""


def add_command(commands: Any) -> None:
    """Add `fmu` to the subparsers of the command line."""
    fmu = commands.add_parser("fmu", help="look into any FMU, validate, run and compare it")
    actions = fmu.add_subparsers(dest="action", required=True, metavar="ACTION")
    viewer = command(actions, "info", "what an FMU contains", _INFO, execute=_info)
    viewer.add_argument("path", type=Path, metavar="FMU", help="an .fmu file")
    summary = "every broken rule of an FMU, with its line"
    judge = command(actions, "validate", summary, _VALIDATE, execute=_validate)
    judge.add_argument("paths", type=Path, metavar="FMU", nargs="+", help=".fmu files")
    summary = "simulate one FMU, and write, tell or plot its outputs"
    runner = command(actions, "run", summary, _RUN, execute=_run)
    _add_run_arguments(runner)
    summary = "compare results, or FMUs by their results"
    comparer = command(actions, "compare", summary, _COMPARE, execute=_compare)
    for name, what in (("first", "CSV, Parquet, run directory or FMU"), ("second", "likewise")):
        comparer.add_argument(name, type=Path, metavar=name.upper(), help=what)
    comparer.add_argument("--relative", type=float, default=1e-6, help="default: %(default)s")
    comparer.add_argument("--absolute", type=float, default=1e-12, help="default: %(default)s")
    comparer.add_argument(
        "--whole", action="store_true", help="both have to begin and end at the same time"
    )
    add_installed(actions, entry_points(group=ACTIONS), "`fmu {}`")


def _add_run_arguments(runner: argparse.ArgumentParser) -> None:
    runner.add_argument("path", type=Path, metavar="FMU", help="FMI 2.0 or 3.0")
    runner.add_argument(
        "--start-value",
        action="append",
        default=[],
        dest="starts",
        metavar="NAME=VALUE",
        help="of a parameter, an input, or a state; may be given several times",
    )
    runner.add_argument("--input", type=Path, metavar="FILE", help="CSV or Parquet")
    for name, what in (
        ("start-time", "the first communication point [s]"),
        ("stop-time", "the last one [s]"),
        ("step", "the communication step size [s], e.g. 0.01 or 1/60"),
    ):
        runner.add_argument(f"--{name}", metavar="SECONDS", help=what)
    runner.add_argument("--kind", choices=KINDS, help="the interface of the FMU that is used")
    runner.add_argument("--solver", choices=SOLVERS, help="of Model Exchange (default: cvode)")
    for name, metavar, what in (
        ("tolerance", "NUMBER", "relative tolerance for the solver"),
        ("solver-step", "SECONDS", "the longest step of the solver of Model Exchange [s]"),
    ):
        runner.add_argument(f"--{name}", metavar=metavar, help=what)
    runner.add_argument(
        "--record",
        action="append",
        default=[],
        metavar="NAME",
        help="an output or a variable inside, or a pattern with `*`; may be given several times\n"
        "(default: all outputs)",
    )
    runner.add_argument("--output", type=Path, metavar="FILE", help="CSV or Parquet")
    runner.add_argument(
        "--plot", metavar="FILE|-", help="an SVG or PNG file, or lines of text in the terminal"
    )
    runner.add_argument(
        "--logging", action="store_true", help="ask the FMU to log all it can, and show it"
    )
    runner.add_argument("--quiet", action="store_true", help="no progress bar")


def _info(arguments: argparse.Namespace) -> Outcome:
    from adapters.fmi.command.info import info  # noqa: PLC0415 - the help needs none of this

    return info(arguments.path)


def _validate(arguments: argparse.Namespace) -> Outcome:
    from adapters.fmi.command.validating import validated  # noqa: PLC0415

    return validated(arguments.paths)


def _run(arguments: argparse.Namespace) -> Outcome:
    from adapters.fmi.command.running import run  # noqa: PLC0415

    return run(arguments)


def _compare(arguments: argparse.Namespace) -> Outcome:
    from adapters.fmi.command.comparing import Tolerance, compare  # noqa: PLC0415

    tolerance = Tolerance(
        relative=arguments.relative, absolute=arguments.absolute, whole=arguments.whole
    )
    return compare(arguments.first, arguments.second, tolerance)
