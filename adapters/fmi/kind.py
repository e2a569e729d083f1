"""Which interface of an FMU is used."""

import enum
from xml.etree import ElementTree as ET


class Kind(enum.Enum):
    """An interface of FMI; its value is what scenarios call it."""

    CO_SIMULATION = "co-simulation"
    MODEL_EXCHANGE = "model-exchange"
    SCHEDULED_EXECUTION = "scheduled-execution"

    @property
    def words(self) -> str:
        """What people call it: `Co-Simulation`."""
        return self.value.replace("-", " ").title().replace("Co ", "Co-")

    @property
    def element(self) -> str:
        """What modelDescription.xml calls it: `CoSimulation`."""
        return self.value.title().replace("-", "")


def kinds_of(root: ET.Element) -> tuple[Kind, ...]:
    """The interfaces that an FMU has, the one first that is used where nothing is said.

    Args:
        root: of modelDescription.xml.
    """
    return tuple(kind for kind in Kind if root.find(kind.element) is not None)
