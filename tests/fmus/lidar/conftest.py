"""The FMU, built once per session."""

from pathlib import Path

import pytest

from tests.fmus.driver import Library

from .harness import Scan, scanner


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The FMU as built for this machine."""
    folder: Path = tmp_path_factory.mktemp("lidar")
    return Library.build("lidar", folder)


@pytest.fixture(scope="session")
def scan(library: Library) -> Scan:
    """Scans a scene once; see `scanner`."""
    return scanner(library)
