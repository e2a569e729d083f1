"""Which interface of an FMU a component uses: `implementation` of SSP, `fmi.kind` of a scenario."""

import typing
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

from orchestrator.parameters import Parameter

OPTION: Final = "fmi.kind"
"""The parameter of a component that chooses one."""

_WORDS: Final = {"CoSimulation": "co-simulation", "ModelExchange": "model-exchange"}


class NoSuchInterfaceError(ValueError):
    """The interface that a package asks for cannot be used; a sentence."""


def interfaces(fmu: Path) -> frozenset[str]:
    """What an FMU has: `CoSimulation`, `ModelExchange`, `ScheduledExecution`.

    Args:
        fmu: which has been read before, so that it is one.
    """
    with zipfile.ZipFile(fmu) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))  # noqa: S314 - read before
    return frozenset(each.tag for each in root) & {*_WORDS, "ScheduledExecution"}


def chosen(asked: str, offered: frozenset[str], parameters: Mapping[str, Parameter]) -> str | None:
    """The value of `fmi.kind` that a component needs; `None` if it needs none.

    Args:
        asked: `implementation` of the component, `any` or one of them.
        offered: what its FMU has.
        parameters: of the component in a scenario.

    Raises:
        NoSuchInterfaceError: the FMU does not have it, or nlosim does not run it.
    """
    if asked == "any":
        return None
    if asked not in offered:
        raise NoSuchInterfaceError(f"the FMU has no {asked}; it has {', '.join(sorted(offered))}")
    if asked == "CoSimulation" or offered == {asked}:
        return None
    option, word = parameters.get(OPTION), _WORDS.get(asked)
    if option is None or word not in _literals(option.type):
        raise NoSuchInterfaceError(f"{asked} is not supported here")
    return word


def _literals(type_: Any) -> tuple[Any, ...]:
    """The words that a type allows for."""
    found: list[Any] = []
    for each in typing.get_args(type_):
        found += typing.get_args(each) or [each]
    return tuple(found)


def used(fmu: Path, values: Mapping[str, Any]) -> str:
    """The `implementation` of a component of a scenario.

    Args:
        fmu: its FMU.
        values: its parameters.
    """
    words = {word: name for name, word in _WORDS.items()}
    if values.get(OPTION) in words:
        return words[values[OPTION]]
    return "CoSimulation" if "CoSimulation" in interfaces(fmu) else "ModelExchange"
