"""What a host may be told to create: nothing that its scenario does not name.

A command to create a component names code: a module and a class, or the file of an FMU, and records
among its parameters name more. Whoever could send one to a host would run what he likes there. So a
host is told beforehand, in the way in which it was started, what it is for, and refuses the rest.
"""

import abc
import hashlib
import json
from collections.abc import Mapping
from typing import Any

from typing_extensions import override

from orchestrator.errors import ComponentTypeError


def digest_of(document: Mapping[str, Any]) -> str:
    """A digest of what a component is made of: its name, type and parameter values.

    Args:
        document: as of `ComponentSpec.to_document`, before or after it has travelled.
    """
    travelled = json.loads(json.dumps(document))
    return hashlib.sha256(json.dumps(travelled, sort_keys=True).encode()).hexdigest()


class Admission(abc.ABC):
    """Which components a host creates when it is told to."""

    @abc.abstractmethod
    def check(self, document: Mapping[str, Any]) -> None:
        """Refuse a component before any of its code is looked for.

        Args:
            document: as of `ComponentSpec.to_document`.

        Raises:
            ComponentTypeError: this host is not for it.
        """


class Anything(Admission):
    """Whatever it is told: a host in the process of who tells it."""

    @override
    def check(self, document: Mapping[str, Any]) -> None:
        pass


class Exactly(Admission):
    """One component, to the last value of a parameter.

    Args:
        digest: `digest_of` its document.
    """

    def __init__(self, digest: str) -> None:
        self._digest = digest

    @override
    def check(self, document: Mapping[str, Any]) -> None:
        if digest_of(document) != self._digest:
            raise ComponentTypeError(
                "this host was started for another component than it is told to create"
            )
