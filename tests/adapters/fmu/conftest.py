"""An FMU of FMI 2.0 for the tests of the importer; those of FMI 3.0 are test units."""

import zipfile
from pathlib import Path

import fmpy
import pytest

from adapters.fmi.unpacked import host_folder
from fmus.native.targets import compile_library, select_targets
from fmus.native.unit import fmi_headers

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def lag2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMI 2.0 FMU in the folder `lag2`."""
    folder = tmp_path_factory.mktemp("lag2")
    target = select_targets(["host"])[0]
    library = folder / f"lag2{fmpy.sharedLibraryExtension}"
    compile_library(
        target,
        sources=[HERE / "lag2" / "lag2.c"],
        include=[HERE / "lag2"],
        system_include=fmi_headers(),
        library=library,
    )
    path = folder / "lag2.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(HERE / "lag2" / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{host_folder(2)}/{library.name}")
    return path
