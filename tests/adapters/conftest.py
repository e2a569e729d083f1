"""The red-light scene in SUMO."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import scenarios
from adapters.sumo.simulation import Sumo
from tests.adapters.scene import Folder

SCENE = Path(scenarios.__file__).parent / "assets" / "red_light" / "red_light.sumocfg"


@pytest.fixture
def sumo() -> Iterator[Sumo]:
    """The scene with seed 0, before its first step of 50 ms."""
    simulation = Sumo(SCENE, 50_000_000, 0)
    yield simulation
    simulation.close()


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """A folder with the net of the scene."""
    return Folder.with_net(tmp_path)
