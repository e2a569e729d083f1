"""FMUs for the tests of the importer that say what no test unit says."""

import ctypes
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import fmpy
import pytest

from adapters.fmi.unpacked import host_folder
from fmus.native.targets import compile_library, select_targets
from fmus.native.unit import fmi_headers
from orchestrator.plan import layouts

LookAt: TypeAlias = Callable[[Callable[[layouts.Plan], None]], None]

HERE = Path(__file__).parent


def built(name: str, version: int, folder: Path, here: Path = HERE) -> Path:
    """The FMU in the folder `name` of `here`."""
    library = folder / f"{name}{fmpy.sharedLibraryExtension}"
    sources = sorted((here / name).glob("*.c"))
    if version == 3:
        sources.append(HERE / "absent3.c")
    compile_library(
        select_targets(["host"])[0],
        sources=sources,
        include=[here / name],
        system_include=fmi_headers(),
        library=library,
    )
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(here / name / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{host_folder(version)}/{library.name}")
    return path


@pytest.fixture(scope="session")
def lag2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 2.0 FMU in the folder `lag2`."""
    return built("lag2", 2, tmp_path_factory.mktemp("lag2"))


@pytest.fixture(scope="session")
def mass2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 2.0 FMU in the folder `mass2`: inputs follow polynomials, outputs have slopes."""
    return built("mass2", 2, tmp_path_factory.mktemp("mass2"))


@pytest.fixture(scope="session")
def ends3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `ends3`: its steps say what came."""
    return built("ends3", 3, tmp_path_factory.mktemp("ends3"))


@pytest.fixture(scope="session")
def starts3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `starts3`: it shows what it was told before the first step."""
    return built("starts3", 3, tmp_path_factory.mktemp("starts3"))


@pytest.fixture(scope="session")
def slopes3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `slopes3`: it tells the derivatives of its outputs."""
    return built("slopes3", 3, tmp_path_factory.mktemp("slopes3"))


@pytest.fixture(scope="session")
def bilinear3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `bilinear3`: it knows its derivatives and stores its state."""
    return built("bilinear3", 3, tmp_path_factory.mktemp("bilinear3"))


@pytest.fixture(scope="session")
def product2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 2.0 FMU in the folder `product2`: as `bilinear3`, and a text."""
    return built("product2", 2, tmp_path_factory.mktemp("product2"))


@pytest.fixture(scope="session")
def words3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `words3`: it gives texts and Binaries back."""
    return built("words3", 3, tmp_path_factory.mktemp("words3"))


@pytest.fixture(scope="session")
def events3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `events3`: events of all kinds."""
    return built("events3", 3, tmp_path_factory.mktemp("events3"))


@pytest.fixture(scope="session")
def clocks3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `clocks3`: clocks of all kinds."""
    return built("clocks3", 3, tmp_path_factory.mktemp("clocks3"))


@pytest.fixture(scope="session")
def partitions3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 3.0 FMU in the folder `partitions3`: Scheduled Execution."""
    return built("partitions3", 3, tmp_path_factory.mktemp("partitions3"))


@pytest.fixture(scope="session", params=[2, 3], ids=["fmi2", "fmi3"])
def ball(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMUs for Model Exchange in the folders `ball2` and `ball3`, of one model."""
    version: int = request.param
    return built(f"ball{version}", version, tmp_path_factory.mktemp("ball"))


@pytest.fixture
def look_at_plans(monkeypatch: pytest.MonkeyPatch) -> LookAt:
    """Have a function look at the plan behind each stretch of the engine."""

    def begin(look: Callable[[layouts.Plan], None]) -> None:
        library = layouts.engine()
        work = library.plan_run

        def looked_at(reference: Any) -> int:
            outcome = int(work(reference))
            look(ctypes.cast(reference, ctypes.POINTER(layouts.Plan)).contents)
            return outcome

        monkeypatch.setattr(library, "plan_run", looked_at)

    return begin
