"""The FMU as the sources make it, and a copy of the golden sample that a test may spoil."""

import shutil
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from fmus.native.build import build_fmu
from fmus.native.targets import select_targets
from fmus.native.unit import load_unit
from orchestrator.parameters import ComponentType
from studies.verification.channel.session import ChannelUnderTest

from .golden_sample import GOLDEN


@pytest.fixture(scope="session")
def channel_type(tmp_path_factory: pytest.TempPathFactory) -> ComponentType:
    """The FMU, built for this machine."""
    folder = tmp_path_factory.mktemp("channel")
    return FmuComponentType(
        build_fmu(load_unit("channel"), folder, targets=select_targets(["host"])).path
    )


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
