"""The FMUs as the sources make them, and a few scenes that were played with them."""

import pytest

from adapters.fmi import FmuComponentType
from fmus.native.build import build_fmu
from fmus.native.targets import select_targets
from fmus.native.unit import load_unit
from orchestrator.parameters import ComponentType
from studies.verification.perception.parameter_set import all_sets
from studies.verification.perception.session import UnitsUnderTest
from studies.verification.perception.verification import Verification, verify

SEED = 5
SCENES = 2


@pytest.fixture(scope="session")
def types(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ComponentType]:
    """The FMUs by their names, built for this machine."""
    host = select_targets(["host"])
    return {
        name: FmuComponentType(
            build_fmu(load_unit(name), tmp_path_factory.mktemp(name), targets=host).path
        )
        for name in ("lidar", "perception")
    }


@pytest.fixture(scope="session")
def units(types: dict[str, ComponentType]) -> UnitsUnderTest:
    """Makes instances of them."""
    return UnitsUnderTest(types["lidar"], types["perception"])


@pytest.fixture(scope="session")
def verification(units: UnitsUnderTest) -> Verification:
    """A few scenes with every parameter set."""
    return verify(units, seed=SEED, scenes=SCENES, sets=all_sets())
