"""The three ways of sharing can take each other's place in a scenario."""

from collections.abc import Callable

import numpy as np
import pytest

from fmus.facilities import AlwaysOnFacilities, CpmFacilities, Facilities
from fmus.facilities.connectors import CONNECTORS
from fmus.facilities.layer import LayerParameters
from fmus.messages.apm import join
from orchestrator.component import Component
from orchestrator.registry import component_type
from tests.fmus.facilities.world import SHARER, Run, apm_of, objects_of

NAMES = ("facilities", "facilities-cpm", "facilities-always-on")
KINDS: dict[str, Callable[[], Component]] = {
    "facilities": lambda: Facilities(Facilities.Parameters()),
    "facilities, what was demanded": lambda: Facilities(Facilities.Parameters(answer="demanded")),
    "facilities-cpm": lambda: CpmFacilities(CpmFacilities.Parameters()),
    "facilities-always-on": lambda: AlwaysOnFacilities(AlwaysOnFacilities.Parameters()),
}


@pytest.mark.parametrize("name", NAMES)
def test_all_have_the_same_connectors(name: str) -> None:
    assert component_type(name).create(name, {}).connectors == CONNECTORS


@pytest.mark.parametrize("name", NAMES)
def test_all_have_the_parameters_of_the_layer(name: str) -> None:
    assert set(LayerParameters.__dataclass_fields__) <= set(component_type(name).parameters)


@pytest.mark.parametrize("name", KINDS)
def test_all_outputs_are_there_from_the_start(name: str) -> None:
    run = Run(KINDS[name]())
    start = set(run.component.outputs())
    run.step()
    assert (
        set(run.component.outputs())
        == start
        == {c for c in CONNECTORS if c.startswith(("packets", "received"))}
    )


@pytest.mark.parametrize("name", KINDS)
def test_the_same_seed_gives_the_same_bytes(name: str) -> None:
    def bytes_sent(seed: int) -> bytes:
        run = Run(KINDS[name](), seed)
        steps = []
        for k in range(40):
            scan = k // 10
            changes = {"apms": join([apm_of(SHARER, scan)]), "objects": objects_of(SHARER, scan)}
            zone = {"blind_zone.center": np.zeros((1, 2)), "blind_zone.range": np.full(1, 9.0)}
            run.step(match__trigger=np.array(True), **changes, **zone)
            steps.append(run.output("packets"))
        return b"".join(steps)

    assert bytes_sent(5) == bytes_sent(5)
    assert bytes_sent(5) != bytes_sent(6)
