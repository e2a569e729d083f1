"""Encoder, lossy channel and facilities coupled: the shares that arrive are those of theory."""

import functools
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pytest
from typing_extensions import override

from fmus.channel.stand_ins.constant_per import ConstantPer
from fmus.facilities import AlwaysOnFacilities
from fmus.facilities.connectors import CONNECTORS
from fmus.messages.features import read_features, write_features
from fmus.messages.records import FEATURES_MIME
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Time
from tests.fmus.facilities.world import SHARER, features_of, world

SCAN: Final = 100_000_000
SCANS: Final = 600
CAPACITY: Final = 6
"""Keypoints of 400 B, two in a packet: three packets in a message."""
PACKETS: Final = 3
PER: Final = 0.3


def traffic() -> FunctionComponent:
    """The vehicles of `world`, at rest."""
    given = {name: value for name, value in world().items() if name.startswith(("vehicle", "ego"))}
    connectors = {
        name: Connector(
            causality=Causality.OUTPUT,
            dtype=CONNECTORS[name].dtype,
            shape=CONNECTORS[name].shape,
            unit=CONNECTORS[name].unit,
        )
        for name in given
    }
    return FunctionComponent(connectors, lambda state, inputs, time: (state, given))


def encoder() -> FunctionComponent:
    """One complete message of the sharer per scan."""
    output = Connector(causality=Causality.OUTPUT, dtype=None, mime_type=FEATURES_MIME)

    def encode(state: Any, _: Signals, time: Time) -> tuple[Any, Signals]:
        message = features_of(SHARER, time, sent=CAPACITY, capacity=CAPACITY, dimensions=97)
        return state, {"features": write_features([message])}

    return FunctionComponent({"features": output}, encode)


class Arrived(Observer):
    """Keypoints of each scan that reached the ego in the end."""

    def __init__(self) -> None:
        self.keypoints: dict[Time, frozenset[int]] = {}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        for message in read_features(bytes(values["facilities"]["received.features"])):
            assert t - 1_000_000_000 <= message.time < t
            self.keypoints[message.time] = frozenset(message.keypoints[:, 0].astype(int).tolist())

    @override
    def end(self, result: SimulationResult) -> None:
        pass


@functools.cache
def arrived(granularity: Any, per: float = PER, scans: int = SCANS) -> list[frozenset[int]]:
    """Keypoints that arrived of each scan, with the same draws at every granularity."""
    facilities = AlwaysOnFacilities.Parameters(
        load="full", loss_granularity=granularity, fragment_size=1000, processing_time=0.0
    )
    components = {
        "traffic": traffic(),
        "encoder": encoder(),
        "channel": ConstantPer(ConstantPer.Parameters(per=per)),
        "facilities": AlwaysOnFacilities(facilities),
    }
    steps = dict.fromkeys(components, SCAN // 2) | {"encoder": SCAN}
    vehicles = list(components["traffic"].connectors)
    links = [
        *((f"traffic.{name}", f"facilities.{name}") for name in vehicles),
        *(
            (f"traffic.{name}", f"channel.{name}")
            for name in vehicles
            if name in components["channel"].connectors
        ),
        ("encoder.features", "facilities.features"),
        ("facilities.packets", "channel.packets"),
        ("channel.receptions", "facilities.receptions"),
    ]
    wires = [Connection(Endpoint.parse(a), Endpoint.parse(b)) for a, b in links]
    told = Arrived()
    simulate(
        System(components, steps, wires),
        GaussSeidel(tuple(components)),
        start=0,
        stop=(scans + 2) * SCAN,
        seed=11,
        observers=[told],
    )
    return [told.keypoints.get(k * SCAN, frozenset()) for k in range(scans)]


def assert_binomial(successes: int, trials: int, share: float) -> None:
    """Within four standard deviations, which a right share leaves once in 16,000 times."""
    deviation = np.sqrt(trials * share * (1 - share))
    assert abs(successes - trials * share) < 4.0 * deviation


@pytest.mark.slow
@pytest.mark.parametrize(
    ("granularity", "share"), [("frame", 1 - PER), ("packets", (1 - PER) ** PACKETS)]
)
def test_the_share_of_usable_messages(granularity: str, share: float) -> None:
    found = arrived(granularity)
    assert {len(keypoints) for keypoints in found} == {0, CAPACITY}
    assert_binomial(sum(map(bool, found)), SCANS, share)


@pytest.mark.slow
def test_the_share_of_usable_keypoints() -> None:
    """Two share a packet, so there are half as many independent trials."""
    found = arrived("keypoint")
    packets = [len({k // 2 for k in keypoints}) for keypoints in found]
    assert [len(keypoints) for keypoints in found] == [2 * count for count in packets]
    assert_binomial(sum(packets), PACKETS * SCANS, 1 - PER)


@pytest.mark.slow
def test_with_the_same_losses_packets_bring_less_than_the_others() -> None:
    frame, packets, keypoint = (arrived(name) for name in ("frame", "packets", "keypoint"))
    for whole, least, part in zip(frame, packets, keypoint, strict=True):
        assert least <= whole
        assert least <= part
        assert bool(whole) == (0 in part)
        assert bool(least) == (len(part) == CAPACITY)


@pytest.mark.parametrize("granularity", ["frame", "packets", "keypoint"])
def test_a_perfect_channel_loses_nothing_and_a_dead_one_all(granularity: str) -> None:
    assert set(arrived(granularity, per=0.0, scans=50)) == {frozenset(range(CAPACITY))}
    assert set(arrived(granularity, per=1.0, scans=50)) == {frozenset()}
