"""The seed of an FMU: drawn before a run, and drawn anew during it where it is tunable."""

from collections.abc import Callable
from typing import Final

import numpy as np
from typing_extensions import override

from adapters.fmi.connectors import SEED, is_seed
from adapters.fmi.description import FmuDescription
from adapters.fmi.instance import FmuInstance
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.capabilities import Redrawing

_LARGEST: Final = int(np.iinfo(np.int32).max)
"""The largest seed that is drawn where the variable says no maximum."""


def seed_of(description: FmuDescription) -> FmuVariable | None:
    """The parameter that selects the random numbers of the FMU; `None` if it has none."""
    variable = description.variables.get(SEED)
    return variable if variable is not None and is_seed(variable) else None


def drawn(variable: FmuVariable, rng: np.random.Generator) -> int:
    """A seed within the bounds of its variable, with one draw from `rng`."""
    low = 0 if variable.minimum is None else max(0, int(variable.minimum))
    limit = _LARGEST if variable.maximum is None else int(variable.maximum)
    return int(rng.integers(low, min(limit, np.iinfo(DTYPES[variable.type]).max), endpoint=True))


def redrawing(description: FmuDescription, instance: Callable[[], FmuInstance]) -> list[object]:
    """What is still to be drawn can be drawn anew, where the seed is a tunable parameter.

    Args:
        description: of the FMU.
        instance: the running one.
    """
    variable = seed_of(description)
    if variable is None or variable.variability != "tunable":
        return []
    return [_TunableSeed(variable, instance)]


class _TunableSeed(Redrawing):
    def __init__(self, variable: FmuVariable, instance: Callable[[], FmuInstance]) -> None:
        self._variable = variable
        self._instance = instance

    @override
    def redraw(self, rng: np.random.Generator) -> None:
        seed = np.array(drawn(self._variable, rng), DTYPES[self._variable.type])
        self._instance().write({SEED: seed})
