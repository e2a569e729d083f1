"""The red-light scene in SUMO."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from adapters.sumo import connection
from adapters.sumo.simulation import Sumo
from tests.adapters.red_light import SCENE, options
from tests.adapters.scene import Folder


@pytest.fixture
def loaded() -> Iterator[Callable[..., Sumo]]:
    """Loads a scene, with a seed or 0, before its first step of 50 ms; closed after the test."""
    opened: list[Sumo] = []

    def load(scene: Path, seed: int = 0) -> Sumo:
        opened.append(Sumo(connection.start("libsumo", options(scene, seed=seed))))
        return opened[-1]

    yield load
    for simulation in opened:
        simulation.close()


@pytest.fixture
def sumo(loaded: Callable[..., Sumo]) -> Sumo:
    """The red light with seed 0, before its first step of 50 ms."""
    return loaded(SCENE)


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """A folder with the net of the scene."""
    return Folder.with_net(tmp_path)
