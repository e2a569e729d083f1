"""Component types that this machine does not have: they are on the host that the scenario names."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

from typing_extensions import override

from orchestrator.errors import ComponentTypeError, Location, Problem
from orchestrator.parameters import ComponentType, Parameter
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.document import Document
from orchestrator.scenario.scalars import NO_FILE


class AbsentType(ComponentType):
    """A component type of which nothing is known here but what the scenario says.

    Args:
        reason: why it is not here.
        said: its parameters, as the scenario file has them.
        where: of what names a file that is not here; `None`: its type is not.
    """

    def __init__(self, reason: str, said: Mapping[str, Any], where: Location | None = None) -> None:
        self.reason = reason
        self.said = said
        self.where = where

    @property
    @override
    def description(self) -> str:
        return ""

    @property
    @override
    def parameters(self) -> Mapping[str, Parameter]:
        return MappingProxyType({})

    @override
    def create(self, name: str, values: Mapping[str, Any]) -> NoReturn:
        raise ComponentTypeError(self.reason)


def absence(document: Document, name: str, kind: ComponentType, host: str | None) -> list[Problem]:
    """Why a component cannot be created here; nothing if its type is here.

    Args:
        document: the scenario.
        name: of the component.
        kind: its type.
        host: that the scenario names for it.
    """
    if not isinstance(kind, AbsentType):
        return []
    elsewhere = f"it is for the host `{host}`, which takes `--hosts FILE`"
    if kind.where is not None:
        return [Problem(kind.where, f"{kind.reason}; {elsewhere}")]
    keys = [key for key in ("fmu", "type") if ("components", name, key) in document.places]
    address = ("components", name, *keys[:1])
    what = f"{spell(address)}: {kind.reason}; {elsewhere}"
    return [Problem(document.value(address), what)]


def are_absent_files(problems: Sequence[Problem]) -> bool:
    """Whether parameters are right but for files that are not here."""
    return bool(problems) and all(NO_FILE in problem.what for problem in problems)
