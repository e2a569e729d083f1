"""The FMU and its formulas, built once per session."""

import pytest

from tests.fmus.driver import Library

from .primitives import Primitives


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The FMU as built for this machine."""
    return Library.build("channel", tmp_path_factory.mktemp("channel"))


@pytest.fixture(scope="session")
def primitives(tmp_path_factory: pytest.TempPathFactory) -> Primitives:
    """The formulas of the channel."""
    return Primitives(tmp_path_factory.mktemp("primitives"))
