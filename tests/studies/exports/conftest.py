"""Fixtures of the tests of exports."""

import shutil
from pathlib import Path

import pytest

from tests.recordings import record
from tests.studies.exports.crowd import CROWD, crowd
from tests.studies.exports.street import run_street


@pytest.fixture(scope="session")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run of `street`, which nobody writes into."""
    return run_street(tmp_path_factory.mktemp("street"))


@pytest.fixture
def run(street: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    copy = tmp_path / "run"
    shutil.copytree(street, copy)
    return copy


@pytest.fixture
def busy(tmp_path: Path) -> Path:
    """The directory of a recording of `crowd`."""
    directory = tmp_path / "busy"
    record(directory, CROWD, [crowd(k) for k in range(5)], component="streets")
    return directory
