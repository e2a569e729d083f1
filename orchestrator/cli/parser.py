"""The arguments of every command."""

import argparse
from importlib.metadata import entry_points
from typing import Final, NoReturn, TypeAlias

from typing_extensions import override

from orchestrator.cli.command import add_installed, command

COMMANDS: Final = "orchestrator.commands"
"""Entry points of further commands: a callable that adds its parsers to the subparsers, each
with the default `execute`, a callable from the parsed arguments to an `Outcome`."""

_SCENARIO: Final = "a scenario file (YAML), or an installed scenario by name (`nlosim scenarios`)"
_SET: Final = """\
PATH=VALUE; replaces or adds a value of the scenario, e.g.
  --set time.stop=5s
  --set components.policy.type=policy-blind
  --set components.channel.parameters.transmit_power="20 dBm"
VALUE is YAML. May be given several times."""

_RUN: Final = """\
The run directory holds the recording, manifest.json, metrics.json, log.txt, and what report and
measures make: tables in measures/, figures in measures.svg and figure.png. Without a report all
recorded numbers are a table, measures/signals-table.csv, and curves; --no-figure leaves the curves
out, --set measures={} both.
Ctrl-C stops the run at the next communication point; what was recorded can be read.

examples:
  nlosim run red_light
  nlosim run red_light --seed 3 --out results/seed-3
  nlosim run my_scenario.yaml --transport local"""

_SCENARIOS: Final = """\
Packages offer theirs by entry points of the group `orchestrator.scenarios`. A copy has the files
that the scenario extends and the package's assets with it.

examples:
  nlosim scenarios
  nlosim scenarios --copy red_light my_study"""

_SCHEMA: Final = """\
Editors with a YAML language server complete and check with it. It knows the parameters of all that
is installed; make it again when that changes. The first line of a scenario file then is
  # yaml-language-server: $schema=scenario.schema.json

examples:
  nlosim schema
  nlosim schema --out scenario.schema.json"""

_CHECK: Final = """\
Prints FILE:LINE:COLUMN: PROBLEM for each, and exits with code 2 if there are any.
The components are created, to see whether their connections fit, but nothing runs.
Remarks say what may not be meant, such as an algebraic loop that the algorithm leaves unsolved."""

_GRAPH: Final = """\
Components in the order in which they step, connections and how old the values that travel
along them are, direct feedthrough and algebraic loops: whether the algorithm solves them."""

_REPORT: Final = """\
Of a run: writes metrics.json, measures/, measures.svg and the report's figure.png
into its directory. If the scenario does not speak of measures, all are asked whose signals are
recorded. Of an experiment, which may have been interrupted: runs.parquet, summary.csv, and the
folder `report` of the experiment's report."""

_EXPERIMENT: Final = """\
The directory holds runs.parquet (one row per run), summary.csv (mean and 95 % interval per
combination of levels) and report/ (what the report that the file names makes of them). What is
finished when Ctrl-C comes is kept; --resume goes on. A run that fails is tried again, then reported
with a command that repeats it. See docs/experiments.md.

examples:
  nlosim experiment studies/red_light/experiments/red_light_methods.yaml
  nlosim experiment studies/red_light/experiments/red_light_methods.yaml --resume
  nlosim experiment methods.yaml --scheduler tcp://head-node:8786"""

_EPILOG: Final = """\
exit codes:
  0  done
  1  what was checked does not pass (`nlosim verify`)
  2  the input is wrong: the scenario, the command line
  3  a component failed; what was recorded until then can be read
  4  interrupted; likewise
  5  internal error, a bug; the message says how to report it

examples:
  nlosim scenarios
  nlosim run red_light --seed 3
  nlosim run red_light --set components.relay.type=relay-direct --json
  nlosim check my_scenario.yaml
  nlosim graph red_light --svg wiring.svg
  nlosim components channel
"""


_Commands: TypeAlias = "argparse._SubParsersAction[_Parser]"  # noqa: SLF001 - it has no public name


class UsageError(Exception):
    """The command line cannot be understood.

    Attributes:
        usage: of the command, for people.
    """

    def __init__(self, message: str, usage: str) -> None:
        super().__init__(message)
        self.usage = usage


class _Parser(argparse.ArgumentParser):
    """Raises instead of ending the process, so that `--json` can report it."""

    @override
    def error(self, message: str) -> NoReturn:
        raise UsageError(message, self.format_usage())


class _Version(argparse.Action):
    """Prints the version."""

    @override
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from orchestrator.provenance import nlosim_version  # noqa: PLC0415 - takes a while

        parser.exit(message=f"nlosim {nlosim_version()}\n")


def parser() -> argparse.ArgumentParser:
    """The parser of `nlosim`."""
    top = _Parser(
        prog="nlosim",
        description="Co-simulation of V2X cooperative perception: scenarios of FMUs and Python "
        "components.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    top.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _add_run(commands)
    _add_check(commands)
    _add_graph(commands)
    _add_components(commands)
    _add_schema(commands)
    _add_scenarios(commands)
    _add_report(commands)
    _add_experiment(commands)
    add_installed(commands, entry_points(group=COMMANDS), "the command `{}`")
    return top


def _add_scenario(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO", help=_SCENARIO)
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="PATH=VALUE", help=_SET
    )


def _add_run(commands: _Commands) -> None:
    run = command(commands, "run", "run a scenario and record it", _RUN)
    _add_scenario(run)
    run.add_argument("--seed", type=int, metavar="N", help="instead of the scenario's seed")
    run.add_argument(
        "--out",
        metavar="DIR",
        help="the run directory, new or empty (default: runs/SCENARIO-SEED, numbered if it exists)",
    )
    run.add_argument(
        "--transport",
        metavar="NAME",
        help="where components marked `process: true` or `process: on-request` run: each in a\n"
        "process of its own on this machine (local, zenoh), whose crash ends the run with a\n"
        "message, or all in this process (in-process, loopback). Without it those marked `true`\n"
        "run as with local, and the others in this process. The results are the same bytes",
    )
    run.add_argument("--no-figure", action="store_true", help="do not draw the report's figure")
    run.add_argument("--quiet", action="store_true", help="no progress bar, no warnings")


def _add_check(commands: _Commands) -> None:
    check = command(commands, "check", "print every problem of a scenario", _CHECK)
    _add_scenario(check)


def _add_graph(commands: _Commands) -> None:
    graph = command(commands, "graph", "print the wiring of a scenario", _GRAPH)
    _add_scenario(graph)
    graph.add_argument("--svg", metavar="FILE", help="draw it, too")


def _add_components(commands: _Commands) -> None:
    components = command(
        commands, "components", "list the installed component types, or describe one", ""
    )
    components.add_argument(
        "name", metavar="NAME", nargs="?", help="an installed type, or the path of an FMU"
    )


def _add_schema(commands: _Commands) -> None:
    schema = command(
        commands, "schema", "print the JSON Schema of scenario files, for editors", _SCHEMA
    )
    schema.add_argument("--out", metavar="FILE", help="write it to a file instead")


def _add_scenarios(commands: _Commands) -> None:
    scenarios = command(
        commands, "scenarios", "list the installed scenarios, or copy one", _SCENARIOS
    )
    scenarios.add_argument(
        "--copy", nargs=2, metavar=("NAME", "DIR"), help="copy one into a directory, to be edited"
    )


def _add_report(commands: _Commands) -> None:
    report = command(
        commands, "report", "make tables and figures of a finished run or experiment again", _REPORT
    )
    report.add_argument("directory", metavar="DIR", help="of a run or an experiment")
    report.add_argument(
        "--measures",
        metavar="NAMES",
        help="of a run: measures to ask beside those of the scenario, e.g. `prr,ttc`;\n"
        "`all`: all whose signals are recorded",
    )
    report.add_argument(
        "--parquet", action="store_true", help="of a run: tables in Parquet files, too"
    )


def _add_experiment(commands: _Commands) -> None:
    experiment = command(
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
    experiment.add_argument("--quiet", action="store_true", help="no progress bar")
