"""The FMUs as the sources make them, and a few scenes that were played with them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.parameters import ComponentType
from studies.verification.perception.parameter_set import all_sets
from studies.verification.perception.session import UnitsUnderTest
from studies.verification.perception.verification import Verification, verify

SEED = 5
SCENES = 2


@pytest.fixture(scope="session")
def types(built: Callable[[str], Path]) -> dict[str, ComponentType]:
    """The FMUs by their names, built for this machine."""
    return {name: FmuComponentType(built(name)) for name in ("lidar", "perception")}


@pytest.fixture(scope="session")
def units(types: dict[str, ComponentType]) -> UnitsUnderTest:
    """Makes instances of them."""
    return UnitsUnderTest(types["lidar"], types["perception"])


@pytest.fixture(scope="session")
def verification(units: UnitsUnderTest) -> Verification:
    """A few scenes with every parameter set."""
    return verify(units, seed=SEED, scenes=SCENES, sets=all_sets())
