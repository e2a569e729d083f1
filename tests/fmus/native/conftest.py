"""FMUs of the test units, and a driver that calls them function by function."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import fmpy.fmi3
import pytest

from fmus.native.build import build_fmu
from fmus.native.targets import select_targets
from fmus.native.unit import load_unit

UNITS = Path(__file__).parent.parent / "units"


@pytest.fixture(scope="session")
def fmu(request: pytest.FixtureRequest) -> Callable[[str], Path]:
    """Build the test unit of that name for this host; kept while nothing changes."""
    assert request.config.cache is not None
    out = Path(request.config.cache.mkdir("nlosim-test-units"))

    def build(name: str) -> Path:
        unit = load_unit(str(UNITS / name))
        return build_fmu(unit, out, targets=select_targets(["host"])).path

    return build


class Driver:
    """One instance of an FMU built from the shell, and what it logged."""

    def __init__(self, path: Path, folder: Path, *, event_mode: bool = False) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.messages: list[tuple[int, str, str]] = []
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        fmpy.extract(str(path), str(folder))
        self.fmu = fmpy.fmi3.FMU3Slave(
            guid=self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="test",
        )
        self.fmu.instantiate(
            eventModeUsed=event_mode,
            logMessage=lambda _, status, category, message: self.messages.append(
                (status, category.decode(), message.decode())
            ),
        )

    def initialise(self, **parameters: float) -> None:
        for name, value in parameters.items():
            self.fmu.setFloat64([self.references[name]], [value])
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def resize(self, **lengths: int) -> None:
        self.fmu.enterConfigurationMode()
        for name, length in lengths.items():
            self.fmu.setUInt64([self.references[name]], [length])
        self.fmu.exitConfigurationMode()

    def set(self, name: str, values: list[float], kind: str = "Float64") -> None:
        getattr(self.fmu, f"set{kind}")([self.references[name]], values)

    def get(self, name: str, count: int = 1, kind: str = "Float64") -> list[float]:
        found: list[float] = getattr(self.fmu, f"get{kind}")([self.references[name]], count)
        return found

    def step(self, t: float, h: float = 0.1) -> None:
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)

    @property
    def last_message(self) -> str:
        return self.messages[-1][2]


@pytest.fixture
def driver(fmu: Callable[[str], Path], tmp_path: Path) -> Iterator[Callable[..., Driver]]:
    """Make a driver of the test unit of that name; freed at the end."""
    made: list[Driver] = []

    def make(name: str, *, event_mode: bool = False) -> Driver:
        made.append(Driver(fmu(name), tmp_path / str(len(made)), event_mode=event_mode))
        return made[-1]

    yield make
    for driver in made:
        driver.fmu.freeInstance()
    shutil.rmtree(tmp_path, ignore_errors=True)
