"""Which components cannot be in the same process, and what is not limited there."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Final

from orchestrator.branching import copying_problems
from orchestrator.errors import Problem
from orchestrator.limits import USUAL
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import ComponentUse

APART_ONLY: Final = "is for components in a process of their own; write `process: true` as well"

_MARK: Final = "write `process: true` here"
_REQUEST: Final = "run with a transport that makes processes (`--transport local`)"


def crowding(document: Document, uses: Mapping[str, ComponentUse]) -> list[Problem]:
    """What is wrong with having all of some components in one process.

    Args:
        document: the scenario.
        uses: by name, in the order of the file; of those that exclude each other the first is
            right, and all others are wrong.
    """
    holders: dict[str, ComponentUse] = {}
    problems = []
    for name, use in uses.items():
        what = _once_per_process(use)
        if what is None:
            continue
        holder = holders.setdefault(what, use)
        if holder is not use:
            address = ("components", name)
            problems.append(
                Problem(
                    document.key(address),
                    f"{spell(address)}: {what} can be in a process once, and it is in "
                    f"`{holder.name}`; {_remedy(use, holder)}",
                )
            )
    return problems


def _remedy(*uses: ComponentUse) -> str:
    marks = {use.process for use in uses}
    if Isolation.ALWAYS in marks:
        return _REQUEST
    return f"{_MARK}, or {_REQUEST}" if Isolation.ON_REQUEST in marks else _MARK


def uncopied(document: Document, uses: Mapping[str, ComponentUse]) -> Iterator[Problem]:
    """Remarks on decisions that cannot be tried, as others are always in processes of their own.

    Args:
        document: the scenario.
        uses: all components, by name.
    """
    apart = [name for name, use in uses.items() if use.process is Isolation.ALWAYS]
    for name in (n for n, use in uses.items() if apart and use.type.decides):
        for what in copying_problems(name, apart):
            yield Problem(document.key(("components", name)), what)


def unlimited(document: Document, uses: Mapping[str, ComponentUse]) -> Iterator[Problem]:
    """Remarks on components in the orchestrator's process whose time or memory was to be limited.

    Args:
        document: the scenario.
        uses: the components in this process, by name.
    """
    for name, use in uses.items():
        for key in ("deadline", "memory", "on_failure"):
            address = ("components", name, key)
            if use.limits != USUAL and address in document.places:
                what = "nothing is limited: it runs in the orchestrator's process"
                yield Problem(document.key(address), f"{spell(address)}: {what}")


def _once_per_process(use: ComponentUse) -> str | None:
    with suppress(Exception):  # wrong parameters; reported when it is created
        return use.type.once_per_process(use.values)
    return None
