"""The arguments of every command."""

import argparse
import difflib
import re
import sys
from collections.abc import Sequence
from typing import Any, Final, NoReturn, TypeAlias

from typing_extensions import override

from orchestrator.cli.command import add_installed, command, seed
from orchestrator.cli.experiment_arguments import add_experiment, add_report
from orchestrator.cli.rerun_arguments import PRIVATE, add_rerun
from orchestrator.cli.resume_arguments import add_resume, interval
from orchestrator.cli.tap_arguments import add_tap
from orchestrator.installed import entry_points
from orchestrator.suggestion import suggestion

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
out, --set measures={} both. index.html shows the run in a browser, without server and network: open
the file.
Ctrl-C stops the run at the next communication point; what was recorded can be read.

examples:
  nlosim run red_light
  nlosim run red_light --seed 3 --out results/seed-3
  nlosim run my_scenario.yaml --transport local"""

_HOSTS: Final = """\
a hosts file (YAML): components marked `host: NAME` are on that host, where
`nlosim serve` has them. Without it they run here. The results are the same bytes"""

_SERVE: Final = """\
The components are created here, from the scenario and the files on this machine: a run says their
names and what it knows of them, but sends no code. Both sides compare releases, the scenario,
digests of FMU or code, inputs and outputs, and say what differs. A component is used by one run at
a time; others wait. Ctrl-C ends it, and a run that uses it.

examples:
  nlosim serve loop.yaml plant --hosts hosts.yaml --host partner
  nlosim serve loop.yaml --once"""

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

_COMPLETION: Final = """\
It knows the commands, options, scenarios and component types that are installed when it is made.

examples:
  source <(nlosim completion bash)              # in ~/.bashrc; likewise zsh in ~/.zshrc
  nlosim completion fish > ~/.config/fish/completions/nlosim.fish"""

_CHECK: Final = """\
Prints FILE:LINE:COLUMN: PROBLEM for each, and exits with code 2 if there are any.
The components are created, to see whether their connections fit, but nothing runs. Of an
experiment that is done with every combination of its levels.
Remarks say what may not be meant, such as an algebraic loop that the algorithm leaves unsolved."""

_GRAPH: Final = """\
Components in the order in which they step, connections and how old the values that travel
along them are, direct feedthrough and algebraic loops: whether the algorithm solves them."""

_EPILOG: Final = """\
exit codes:
  0  done
  1  what was checked does not pass (`nlosim verify`, `nlosim rerun`)
  2  the input is wrong: the scenario, the command line
  3  a component failed; what was recorded until then can be read. Or a measure, a report or a
     command of a package failed; what the others found is there
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
        raise UsageError(_with_hint(self, message), self.format_usage())

    @override
    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        given = sys.argv[1:] if args is None else list(args)
        found, unknown = self.parse_known_args(given, namespace)
        if unknown:
            asked = _innermost(self, given)
            asked.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found


_CHOICE: Final = re.compile(r"argument (?P<what>\S+): invalid choice: '(?P<said>[^']*)'.*")


def _with_hint(parser: argparse.ArgumentParser, message: str) -> str:
    """What is wrong with the command line, and which word may have been meant."""
    match = _CHOICE.fullmatch(message)
    if match is not None and match["what"].isupper():  # a command, or an action of one
        hint = suggestion(match["said"], _words(parser))
        return f"no {match['what'].lower()} `{match['said']}`; {hint}"
    unknown = message.removeprefix("unrecognized arguments: ")
    if unknown == message:
        return message
    options = [o for a in arguments_of(parser) for o in a.option_strings if o.startswith("--")]
    for word in unknown.split():
        name = word.partition("=")[0]
        close = difflib.get_close_matches(name, options, n=1) if name.startswith("-") else []
        if close:
            return f"{message}; did you mean `{close[0]}`?"
    return message


def _words(parser: argparse.ArgumentParser) -> list[str]:
    """The commands of a parser, or the actions of a command."""
    return [str(name) for action in arguments_of(parser) for name in action.choices or ()]


def arguments_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The arguments of a parser, for which `argparse` has no public name."""
    return parser._actions  # noqa: SLF001


def _innermost(parser: argparse.ArgumentParser, given: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of the command, or of its action, that these words name."""
    for word in given:
        choices = [a.choices for a in arguments_of(parser) if isinstance(a.choices, dict)]
        parser = next((each[word] for each in choices if word in each), parser)
    return parser


class _Version(argparse.Action):
    """Prints the version."""

    @override
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from orchestrator.provenance import nlosim_version  # noqa: PLC0415 - takes a while

        parser.exit(message=f"nlosim {nlosim_version()}\n")


def parser(given: Sequence[str] = ()) -> argparse.ArgumentParser:
    """The parser of `nlosim`.

    Args:
        given: what it will be asked to parse, so that installed packages are loaded only if their
            commands may be meant: if the first word is a command of ours, none is, and if one of
            them offers that word, no other. Without it the parser has all commands.
    """
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
    _add_hosts(add_resume(commands))
    add_rerun(commands)
    _add_serve(commands)
    _add_check(commands)
    _add_graph(commands)
    _add_components(commands)
    _add_schema(commands)
    _add_completion(commands)
    _add_scenarios(commands)
    add_report(commands)
    add_tap(commands)
    _add_hosts(add_experiment(commands))
    _add_others(commands, given[0] if given else None)
    return top


def _add_others(commands: _Commands, asked: str | None) -> None:
    """Add the commands of installed packages, unless `asked` is there already, or without them."""
    offered = list(entry_points(group=COMMANDS))
    named = [entry for entry in offered if entry.name == asked]
    others = [entry for entry in offered if entry.name != asked]
    for entries in (named, others):
        if asked not in commands.choices:
            add_installed(commands, entries, "the command `{}`")


def _add_scenario(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO", help=_SCENARIO)
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="PATH=VALUE", help=_SET
    )


def _add_run(commands: _Commands) -> None:
    run = command(commands, "run", "run a scenario and record it", _RUN)
    _add_scenario(run)
    run.add_argument("--seed", type=seed, metavar="N", help="instead of the scenario's seed")
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
    run.add_argument(
        "--checkpoint",
        type=interval,
        metavar="TIME",
        help="simulated time between checkpoints, such as 10s: from the last one `nlosim resume`\n"
        "goes on if the run is cut off (default: none, so that all of it is made again)",
    )
    _add_hosts(run)
    run.add_argument("--private", action="store_true", help=PRIVATE)
    run.add_argument(
        "--no-figure", action="store_true", help="draw nothing: no figures, and no index.html"
    )
    run.add_argument("--no-page", action="store_true", help="do not write index.html")
    run.add_argument("--quiet", action="store_true", help="no progress bar, no warnings")
    run.add_argument(
        "--tap", action="store_true", help="let `nlosim tap` look at the signals meanwhile"
    )


def _add_hosts(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--hosts", metavar="FILE", help=_HOSTS)


def _add_serve(commands: _Commands) -> None:
    serve = command(commands, "serve", "serve components to runs on other hosts", _SERVE)
    serve.add_argument("scenario", metavar="SCENARIO", help=_SCENARIO)
    serve.add_argument(
        "components",
        metavar="COMPONENT",
        nargs="*",
        help="components of the scenario (default: all that it marks with this host)",
    )
    serve.add_argument(
        "--hosts",
        metavar="FILE",
        help="a hosts file (YAML), which says where to listen (default: hosts.yaml beside the\n"
        "scenario)",
    )
    serve.add_argument(
        "--host",
        metavar="NAME",
        help="which of the hosts this one is (default: the one that the scenario names for the\n"
        "components)",
    )
    serve.add_argument(
        "--once", action="store_true", help="end when each component has been used by one run"
    )
    serve.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="PATH=VALUE", help=_SET
    )


def _add_check(commands: _Commands) -> None:
    check = command(commands, "check", "print every problem of a scenario or an experiment", _CHECK)
    _add_scenario(check)
    check.add_argument(
        "--checkpoint",
        type=interval,
        metavar="TIME",
        help="say which components `nlosim resume` restores from checkpoints of a run, and which\n"
        "step again",
    )
    _add_hosts(check)


def _add_graph(commands: _Commands) -> None:
    graph = command(commands, "graph", "print the wiring of a scenario", _GRAPH)
    _add_scenario(graph)
    _add_hosts(graph)
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


def _add_completion(commands: _Commands) -> None:
    completion = command(
        commands, "completion", "print what a shell needs to complete words", _COMPLETION
    )
    completion.add_argument("shell", metavar="SHELL", choices=("bash", "zsh", "fish"))


def _add_scenarios(commands: _Commands) -> None:
    scenarios = command(
        commands, "scenarios", "list the installed scenarios, or copy one", _SCENARIOS
    )
    scenarios.add_argument(
        "--copy", nargs=2, metavar=("NAME", "DIR"), help="copy one into a directory, to be edited"
    )
