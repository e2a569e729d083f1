"""The FMU, built once per session."""

import pytest

from .harness import Library


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The FMU as built for this machine."""
    return Library.build(tmp_path_factory.mktemp("perception"))
