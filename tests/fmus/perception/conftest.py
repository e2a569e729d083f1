"""The FMU, built once per session."""

import pytest

from tests.fmus.driver import Library


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The FMU as built for this machine."""
    return Library.build("perception", tmp_path_factory.mktemp("perception"))
