"""The seed of the channel may change during a run: what is still to be drawn is drawn anew."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from fmus.messages.records import RECEPTION, unframe
from orchestrator.capabilities import Redrawing
from orchestrator.component import Component
from orchestrator.signal import Array, Causality, Signals
from tests.fmus.driver import Library
from tests.fmus.scene import Scene

from .harness import MS, NO_OBSTACLES, Channel, packet, packets, row_of_cars

NAKAGAMI = {"fading": 2.0, "medium_access": False, **NO_OBSTACLES}
FRAMES = 50


def _halves(library: Library, scene: Scene, first: int, second: int) -> tuple[bytes, bytes]:
    """The receptions of two steps with equal numbers of packets and these seeds."""
    with Channel(library, scene, seed=first, **NAKAGAMI) as channel:
        found = []
        for k, seed in enumerate((first, second)):
            channel.set("seed", np.array(seed, np.uint64))
            begin = k * FRAMES * MS
            records = [packet(FRAMES * k + n, 0, time=begin + n * MS) for n in range(FRAMES)]
            found.append(channel.step(begin / 1e9, FRAMES * 1e-3, records).tobytes())
    return found[0], found[1]


def test_a_seed_set_between_steps_holds_from_the_next_step_on(library: Library) -> None:
    scene = row_of_cars([100.0, 300.0, 700.0])
    ones, fives = (_halves(library, scene, seed, seed) for seed in (1, 5))
    assert _halves(library, scene, 1, 5) == (ones[0], fives[1])
    assert ones[0] != fives[0]
    assert ones[1] != fives[1]


def _inputs(component: Component, scene: Scene, library: Library, sent: bytes) -> Signals:
    values = {
        name: connector.start_value()
        for name, connector in component.connectors.items()
        if connector.causality is Causality.INPUT
    }
    return {**values, **scene.inputs(library), "packets": sent}


@pytest.mark.slow
def test_the_component_redraws_and_equal_streams_redraw_equally(
    library: Library, built: Callable[[str], Path]
) -> None:
    """Three runs; two of them redraw after the first of two steps."""
    scene = row_of_cars([100.0, 300.0, 700.0])
    found: list[list[bytes]] = []
    for redrawn in (None, 4, 4):
        kind = FmuComponentType(built("channel"))
        component = kind.create("channel", {"fading": "nakagami", "medium_access": False})
        component.setup(0, np.random.default_rng(7))
        component.initialise(_inputs(component, scene, library, b""))
        steps: list[bytes] = []
        for k in range(2):
            begin = k * FRAMES * MS
            records: list[Array] = [
                packet(FRAMES * k + n, 0, time=begin + n * MS) for n in range(FRAMES)
            ]
            if k == 1 and redrawn is not None:
                chance = component.capability(Redrawing)  # type: ignore[type-abstract]
                assert chance is not None
                chance.redraw(np.random.default_rng(redrawn))
            sent = _inputs(component, scene, library, packets(records))
            component.step(sent, begin, FRAMES * MS)
            received = unframe("RCPT", bytes(component.outputs()["receptions"]), RECEPTION)
            assert len(received) > FRAMES
            steps.append(received.tobytes())
        component.close()
        found.append(steps)
    assert found[1] == found[2]
    assert found[0][0] == found[1][0]
    assert found[0][1] != found[1][1]
