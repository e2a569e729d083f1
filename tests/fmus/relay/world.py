"""What relay policies are given: an ego at the origin, a sharer 60 m north, neighbours."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmus.messages.records import OBJECT, frame
from fmus.physics.propagation import wavelength
from fmus.relay.connectors import CONNECTORS
from fmus.relay.radio import Radio
from orchestrator.component import Component
from orchestrator.signal import Causality, Signal
from tests.fmus.boxes import put

EGO, SHARER, LEFT, RIGHT = 1, 2, 3, 4
STEP = 100_000_000
Inputs = dict[str, Signal]
NEIGHBOURS = {SHARER: (0.0, 60.0, 1.8), LEFT: (-20.0, 30.0, 1.5), RIGHT: (25.0, 30.0, 1.5)}
"""id -> x, y, vehicle height."""


def inputs(table: Mapping[int, tuple[float, float, float]], objects: Any = None) -> Inputs:
    """The inputs with these neighbours heard just now, no powers known, and fusion triggered."""
    values: Inputs = {
        name: connector.start_value()
        for name, connector in CONNECTORS.items()
        if connector.causality is Causality.INPUT
    }
    rows = sorted(table.items())
    values |= {
        "ego.id": np.array(EGO),
        "ego.size": np.array([4.5, 1.8, 1.5]),
        "ego.speed": np.array(8.0),
        "ego.heading": np.array(np.pi / 2),
        "objects": b"" if objects is None else frame("OBJS", objects),
        "received.bsm.id": np.array([v for v, _ in rows], np.int64),
        "received.bsm.position": np.array([p[:2] for _, p in rows]).reshape(-1, 2),
        "received.bsm.heading": np.full(len(rows), np.pi / 2),
        "received.bsm.velocity": np.zeros((len(rows), 2)),
        "received.bsm.size": np.array([(4.5, 1.8, p[2]) for _, p in rows]).reshape(-1, 3),
        "received.bsm.antenna_height": np.array([p[2] for _, p in rows]),
        "received.bsm.age": np.zeros(len(rows)),
        "match.sharer": np.array([SHARER, -1], np.int64),
        "match.trigger": np.array(True),
    }
    return values


def with_powers(values: Inputs, hops: Mapping[int, tuple[float, float]]) -> Inputs:
    """`values` with the powers [dBm] of sharer-candidate and candidate-ego; NaN: not known."""
    links = [(SHARER, vehicle, hop[0]) for vehicle, hop in hops.items()]
    links += [(vehicle, EGO, hop[1]) for vehicle, hop in hops.items()]
    known = [link for link in links if not np.isnan(link[2])]
    return values | {
        "received.link.transmitter": np.array([link[0] for link in known], np.int64),
        "received.link.receiver": np.array([link[1] for link in known], np.int64),
        "received.link.power": np.array([link[2] for link in known], np.float64),
    }


def truck(x: float, y: float, height: float = 4.0) -> Any:
    """A standing truck as the ego's lidar reports it."""
    row = np.zeros(1, OBJECT)
    row["sensor"], row["instance"], row["points"] = EGO, 77, 100
    put(row, (x - 1.25, y - 5), (x + 1.25, y + 5))
    row["height"] = height
    return row


def started(component: Component, seed: int = 0) -> Component:
    component.setup(0, np.random.default_rng(seed))
    return component


def chosen(component: Component, values: Inputs, t: int = 0) -> int:
    component.step(values, t, STEP)
    return int(np.asarray(component.outputs()["relay"]))


def switches(component: Component) -> int:
    return int(np.asarray(component.outputs()["switches"]))


def radio(uncertainty: float = 0.0) -> Radio:
    """The radio of the paper's table I, without fading."""
    return Radio(
        transmit_power=26.0,
        noise_floor=-98.0,
        sensitivity=-94.0,
        cca_threshold=-65.0,
        missed=0.3,
        capture_margin=10.0,
        wavelength=wavelength(5.9e9),
        packet_size=238,
        fading_m=0.0,
        uncertainty=uncertainty,
    )
