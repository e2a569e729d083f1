"""The FMU as the sources make it, and a copy of the golden sample that a test may spoil."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.parameters import ComponentType
from studies.verification.channel.session import ChannelUnderTest

from .golden_sample import GOLDEN


@pytest.fixture(scope="session")
def channel_type(built: Callable[[str], Path]) -> ComponentType:
    """The FMU, built for this machine."""
    return FmuComponentType(built("channel"))


@pytest.fixture(scope="session")
def channel(channel_type: ComponentType) -> ChannelUnderTest:
    """Makes instances of it."""
    return ChannelUnderTest(channel_type)


@pytest.fixture
def golden(tmp_path: Path) -> Path:
    """A copy of the sample."""
    folder = tmp_path / "golden"
    shutil.copytree(GOLDEN, folder)
    return folder
