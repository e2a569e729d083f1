"""Inputs that a scenario says nothing shall drive: `without`."""

from collections.abc import Iterator, Mapping

from orchestrator.errors import Problem
from orchestrator.gaps import is_among
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.model import ComponentUse
from orchestrator.signal import Causality
from orchestrator.suggestion import suggestion
from orchestrator.system import System


def wrong_words(
    document: Document, uses: Mapping[str, ComponentUse], system: System
) -> Iterator[Problem]:
    """Words of `without` that are no inputs, or inputs that something drives all the same.

    Args:
        document: the scenario.
        uses: its components.
        system: they with their connections.
    """
    for name, use in uses.items():
        inputs = [
            key
            for key, connector in system.connectors[name].items()
            if connector.causality is Causality.INPUT
        ]
        driven = system.driven(name)
        for n, word in enumerate(use.without):
            named = [key for key in inputs if is_among(key, [word])]
            what = ""
            if not named:
                groups = dict.fromkeys(key.rpartition(".")[0] or key for key in inputs)
                what = f"`{name}` has no input `{word}`; {suggestion(word, [*groups, *inputs])}"
            elif read := [key for key in named if key in driven]:
                what = f"a connection drives `{name}.{read[0]}`; take one of the two away"
            if what:
                address = ("components", name, "without", n)
                yield Problem(document.value(address), f"{spell(address)}: {what}")
