"""Which components cannot be in the same process."""

from collections.abc import Mapping
from contextlib import suppress

from orchestrator.errors import Problem
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.model import ComponentUse

_TRANSPORT = "run with a transport that makes processes (`--transport local`)"


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
            mark = "" if use.process or holder.process else "write `process: true` here and "
            problems.append(
                Problem(
                    document.key(address),
                    f"{spell(address)}: {what} can be in a process once, and it is in "
                    f"`{holder.name}`; {mark}{_TRANSPORT}",
                )
            )
    return problems


def _once_per_process(use: ComponentUse) -> str | None:
    with suppress(Exception):  # wrong parameters; reported when it is created
        return use.type.once_per_process(use.values)
    return None
