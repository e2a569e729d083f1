"""`nlosim bench`, found by the entry point group `orchestrator.commands`."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, Final

from benchmarks import offers
from benchmarks.benchmark import Benchmark
from benchmarks.harness import Result, measure
from benchmarks.machine import environment
from benchmarks.table import table
from orchestrator.cli.command import command
from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import CosimError
from orchestrator.suggestion import suggestion

REPEAT: Final = 5
"""Repetitions unless the user says otherwise; odd, so that the median is one of them."""

_DETAILS: Final = """\
Times are CPU times of this process, user and system, unless a benchmark says wall time.
Repetitions of the cases take turns; shown are the median and, in brackets, the smallest and the
largest. A ratio above 1 means that ours is better than the peer. Ctrl-C prints what was measured
until then.

examples:
  nlosim bench --list
  nlosim bench channel --repeat 3
  nlosim bench channel --case 'grid200*' --json
  nlosim bench policy --set network=mine.safetensors"""


class SettingError(CosimError):
    """A setting that no benchmark has, or one that is not well formed. Exit code 2."""


def add_command(commands: Any) -> None:
    """Add `bench` to the subparsers of the command line."""
    summary = "measure how fast it is, beside what people use today"
    title = "Run benchmarks: one, or all that are installed."
    bench = command(
        commands, "bench", summary, _DETAILS, description=title, execute=execute, abbreviated=True
    )
    bench.add_argument("name", metavar="NAME", nargs="?", help="one benchmark (default: all)")
    bench.add_argument("--list", action="store_true", help="say what there is, and measure nothing")
    bench.add_argument(
        "--repeat",
        type=_count,
        default=REPEAT,
        metavar="N",
        help=f"measure each case N times (default: {REPEAT})",
    )
    bench.add_argument(
        "--case",
        default="*",
        metavar="PATTERN",
        help="only cases that match, with the wildcards of a shell",
    )
    bench.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a setting of the benchmark; may be repeated",
    )


def _count(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 on, got {text!r}")
    return number


def execute(arguments: argparse.Namespace) -> Outcome:
    """List benchmarks, or run one or all."""
    names = list(offers.installed()) if arguments.name is None else [arguments.name]
    if arguments.list:
        return _listed(names)
    found: list[dict[str, Any]] = []
    texts: list[str] = []
    is_complete = True
    benchmarks = {name: offers.benchmark(name) for name in names}
    settings = _settings(arguments.set, arguments.name, benchmarks)
    for benchmark in benchmarks.values():
        benchmark.require()  # before the first of them is measured
    with stopping():  # SIGTERM, too, is Ctrl-C
        for name, benchmark in benchmarks.items():
            result = measure(benchmark, repeat=arguments.repeat, pattern=arguments.case, label=name)
            description, peer = benchmark.description, _peer(benchmark, result)
            found.append({**_data(name, description, peer, result), "settings": settings})
            texts += [f"{name}: {description}", *table(result.rows), *([peer] if peer else []), ""]
            is_complete = result.is_complete
            if not is_complete:
                break
    where = environment()
    data = {**found[0], **where} if arguments.name else {"benchmarks": found, **where}
    text = "\n".join([*texts, _machine_text(where)])
    return Outcome(text=text, data=data) if is_complete else _interrupted(text, data)


def _settings(
    texts: Sequence[str], name: str | None, benchmarks: Mapping[str, Benchmark]
) -> Mapping[str, str]:
    """What was set, after telling the benchmark `name`.

    Raises:
        SettingError: there is no such setting, or nobody whose setting it is.
    """
    if not texts:
        return {}
    if name is None:
        raise SettingError("`--set` changes a setting of one benchmark: give its name, too")
    known = benchmarks[name].settings
    found = {}
    for text in texts:
        key, sign, value = text.partition("=")
        if not sign or not value:
            raise SettingError(f"`--set {text}` is no NAME=VALUE")
        if key not in known:
            what = f"the benchmark `{name}` has no setting `{key}`; {suggestion(key, known)}"
            raise SettingError(what)
        found[key] = value
    benchmarks[name].configure(found)
    return found


def _peer(benchmark: Benchmark, result: Result) -> str:
    """The peers with which ours is compared, and the cases that failed to be measured."""
    failed = [f"`{name}`: {how}" for name, how in result.left_out.items()]
    return "; ".join(filter(None, [benchmark.peer, *(f"left out: {each}" for each in failed)]))


def _data(name: str, description: str, peer: str, result: Result) -> dict[str, Any]:
    return {
        "name": name,
        "description": description,
        "peer": peer,
        "repetitions": result.repetitions,
        "complete": result.is_complete,
        "rows": [row.as_json() for row in result.rows],
    }


def _interrupted(text: str, data: dict[str, Any]) -> Outcome:
    """What was measured, in full; and the exit code of an interruption."""
    code = Exit.INTERRUPTED
    error = {"kind": "interrupted", "exit_code": int(code), "message": "interrupted"}
    return Outcome(
        text=f"{text}\ninterrupted: these are the cases measured until then",
        data={**data, "error": error},
        exit_code=code,
    )


def _listed(names: list[str]) -> Outcome:
    rows = [{"name": name, "description": offers.benchmark(name).description} for name in names]
    lines = [f"{row['name']}: {row['description']}" for row in rows]
    return Outcome(
        text="\n".join(lines) or "no benchmarks are installed", data={"benchmarks": rows}
    )


def _machine_text(where: Any) -> str:
    machine, versions = where["machine"], where["versions"]
    parts = [
        f"{machine['cpu']}, {machine['cpus']} CPUs",
        f"load average {machine['load_average']}",
        ", ".join(f"{name} {version}" for name, version in versions.items()),
        *([f"commit {where['commit']}"] if where["commit"] else []),
    ]
    return "machine: " + "; ".join(parts)
