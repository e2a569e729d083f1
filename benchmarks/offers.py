"""Benchmarks by name, found through the entry points of installed packages."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from typing import Final

from benchmarks.benchmark import Benchmark
from orchestrator.errors import CosimError
from orchestrator.installed import entry_points
from orchestrator.suggestion import suggestion

BENCHMARKS: Final = "orchestrator.benchmarks"
"""Entry points of benchmarks: a subclass of `Benchmark` that takes no arguments."""


class BenchmarkError(CosimError):
    """A benchmark cannot be found or loaded. Exit code 2."""


def installed() -> Mapping[str, EntryPoint]:
    """Every benchmark on offer, sorted by name; nothing is imported.

    Raises:
        BenchmarkError: two packages offer the same name.
    """
    found: dict[str, EntryPoint] = {}
    for entry in sorted(set(entry_points(group=BENCHMARKS)), key=lambda entry: entry.name):
        if entry.name in found:
            raise BenchmarkError(
                f"benchmark `{entry.name}` is offered several times: {found[entry.name].value}, "
                f"{entry.value}; uninstall one of these packages"
            )
        found[entry.name] = entry
    return found


def benchmark(name: str) -> Benchmark:
    """The benchmark called `name`.

    Raises:
        BenchmarkError: nothing of that name is installed, or it cannot be loaded.
    """
    offers = installed()
    if name not in offers:
        raise BenchmarkError(f"there is no benchmark `{name}`; {suggestion(name, offers)}")
    entry = offers[name]
    try:
        made = entry.load()()
    except Exception as error:
        kind = type(error).__name__
        raise BenchmarkError(
            f"cannot load the benchmark `{name}` from `{entry.value}`: {kind}: {error}"
        ) from error
    if not isinstance(made, Benchmark):
        raise BenchmarkError(f"benchmark `{name}`: `{entry.value}` makes no `Benchmark`")
    return made
