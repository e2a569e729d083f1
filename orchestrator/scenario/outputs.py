"""The files that components of a scenario write, and what is wrong with these."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from orchestrator.errors import Problem
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import ComponentUse


def sharing(document: Document, uses: Mapping[str, ComponentUse]) -> Iterator[Problem]:
    """Components that write a file that another one writes, too.

    Args:
        document: the scenario.
        uses: by name, in the order of the file; of those with one file the first is right.
    """
    writers: dict[Path, str] = {}
    for name, use in uses.items():
        for path in _files(use):
            writer = writers.setdefault(path, name)
            if writer != name:
                address = ("components", name)
                what = f"writes `{path}`, as `{writer}` does; give it another name"
                yield Problem(document.key(address), f"{spell(address)}: {what}")


def belonging_here(document: Document, uses: Mapping[str, ComponentUse]) -> Iterator[Problem]:
    """Components in other processes that write into the directory of the run.

    Args:
        document: the scenario.
        uses: by name; those that are not marked are left out.
    """
    for name, use in uses.items():
        key = "process" if use.host is None else "host"
        is_marked = use.process is not Isolation.NEVER or use.host is not None
        if is_marked and any(not path.is_absolute() for path in _files(use)):
            what = f"writes into the directory of the run, which is here; remove `{key}`"
            where = document.value(("components", name, key))
            yield Problem(where, f"{spell(('components', name))}: {what}")


def repeated(document: Document, uses: Mapping[str, ComponentUse]) -> Iterator[Problem]:
    """Components that write a file elsewhere, which every run of an experiment would write anew.

    Args:
        document: the scenario.
        uses: by name.
    """
    for name, use in uses.items():
        for path in _files(use):
            if path.is_absolute():
                address = ("components", name)
                what = (
                    f"all runs of an experiment would write `{path}`; without a folder each writes "
                    "into its own directory, which `--keep-runs` keeps"
                )
                yield Problem(document.key(address), f"{spell(address)}: {what}")


def _files(use: ComponentUse) -> tuple[Path, ...]:
    with suppress(Exception):  # wrong parameters; reported when it is created
        return use.type.output_files(use.values)
    return ()
