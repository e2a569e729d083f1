"""Which vehicle types of a scene are distributions, from which SUMO draws one."""

from pathlib import Path

from typing_extensions import override

from adapters.sumo.checks.demand import DISTRIBUTION
from adapters.sumo.checks.reading import Attributes, Elements, mentions, read
from adapters.sumo.files import read_scene


def distributions_of(config: Path) -> frozenset[str]:
    """The ids of the distributions of vehicle types that a scene declares.

    SUMO lists them among the types, and draws from its random numbers whenever one is asked for
    its size: whoever only looks would change the traffic.

    Args:
        config: the configuration of the scene (`*.sumocfg`).
    """
    files, _ = read_scene(config)
    found = _Distributions()
    for path in (*files.additionals, *files.routes):
        if mentions(path, f"<{DISTRIBUTION}".encode()):
            read(path, found)
    return frozenset(found.names)


class _Distributions(Elements):
    def __init__(self) -> None:
        super().__init__()
        self.names: set[str] = set()

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        if name == DISTRIBUTION and "id" in attributes:
            self.names.add(attributes["id"])
