"""A roadside unit in the whole study: it relays, and nobody takes it for anything else."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from adapters.sumo.roadside import BODY_SIZE, FIRST_NUMBER as UNIT
from fmus.messages.records import APM, SENSOR_DATA, TRANSMISSION, unframe
from orchestrator.cli import main
from orchestrator.component import Component
from orchestrator.recording import Recording
from orchestrator.registry import installed
from orchestrator.signal import Causality, Signals
from studies.red_light.roles import EGO, SHARING
from studies.red_light.traces import Array, Traces

FOLDER = Path(scenarios.__file__).parent
EARLY = {"components.traffic.parameters.entities.ego.position.to_end": "75 m"}
"""Fusion begins in the first second."""
ONLY_THE_UNIT = {
    "components.traffic.parameters.equipment.all.radio": "0",
    "components.relay.type": "relay-random",
}


def run(scenario: str, out: Path, stop: str, **settings: str) -> Traces:
    """The recording of a run."""
    sets = [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
    command = ["run", str(FOLDER / scenario), "--out", str(out), "--set", f"time.stop={stop}"]
    assert main([*command, *sets, "--quiet", "--transport", "in-process"]) == 0
    return Traces(Recording(out))


def table(traces: Traces, name: str, magic: str, dtype: Any) -> Array:
    series = traces.series(name)
    return np.concatenate([unframe(magic, bytes(series[k]), dtype) for k in range(len(series))])


@pytest.mark.slow
def test_what_only_it_can_relay_arrives_over_it(tmp_path: Path) -> None:
    traces = run("red_light_rsu.yaml", tmp_path / "run", "5 s", **EARLY, **ONLY_THE_UNIT)
    ego, sharer = traces.vehicle_with(EGO), traces.vehicle_with(SHARING)
    sent = traces.packets[traces.packets["kind"] == SENSOR_DATA]
    routed = sent[sent["route"][:, 0] == UNIT]
    assert len(routed) > 20
    assert set(np.unique(sent["route"][:, 0])) <= {UNIT, -1}
    heard = traces.receptions[(traces.receptions["outcome"] == 0)]
    at_ego = heard[(heard["receiver"] == ego) & (heard["addressed"] == 1) & (heard["hop"] == 1)]
    assert set(at_ego["transmitter"]) == {UNIT}
    assert np.isin(routed["id"], at_ego["packet"]).mean() > 0.7
    assert (traces.packets["source"] != UNIT)[traces.packets["kind"] == APM].all(), "no lidar"
    sharers = traces.series("perception.match.sharer")
    assert all(UNIT not in np.asarray(sharers[k]) for k in range(len(sharers)))
    assert sharer in {int(np.asarray(sharers[k])[0]) for k in range(len(sharers))}
    assert (tmp_path / "run" / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_no_lidar_sees_it(tmp_path: Path) -> None:
    """It stands 18 m from the sharing node, in its view; what is made of all scans is the same."""
    with_it, without = (
        run(f"red_light{name}.yaml", tmp_path / f"run{name}", "2 s") for name in ("_rsu", "")
    )
    for signal in ("apms", "objects"):
        a, b = (traces.series(f"perception.{signal}") for traces in (with_it, without))
        assert len(a) == len(b) > 15
        for k in range(len(a)):
            same = bytes(a[k]) == bytes(b[k])
            assert same, f"{signal} at {a.times[k]} ns"


def inputs(component: Component, values: Mapping[str, Any]) -> Signals:
    """`values`, and start values for all other inputs."""
    start = {
        name: connector.start_value()
        for name, connector in component.connectors.items()
        if connector.causality is Causality.INPUT
    }
    return {**start, **values}


@pytest.mark.parametrize("distance", [10.0, 50.0, 200.0])
def test_it_shadows_no_link_and_not_its_own(distance: float) -> None:
    """A link through the mast, and one from its top: free space, both."""
    channel = installed()["channel"].load().create("channel", {})
    channel.setup(0, np.random.default_rng(1))
    mast = (0.3 * distance, 0.0)
    across, own = [(0.0, 0.0, 1.5), (distance, 0.0, 1.5)], [(*mast, 5.0), (distance, 0.0, 1.5)]
    links = np.array([across, own])
    values = {
        "vehicle.id": np.array([UNIT]),
        "vehicle.position": np.array([[*mast, 0.0]]),
        "vehicle.heading": np.zeros(1),
        "vehicle.size": np.full((1, 3), BODY_SIZE),
        "vehicle.antenna_height": np.array([5.0]),
        "vehicle.equipped": np.ones(1, np.bool_),
        "probe.transmitter": links[:, 0],
        "probe.receiver": links[:, 1],
        "probe.carrier": np.array([(-1, -1), (UNIT, -1)]),
        "probe.size": np.full(2, 200, np.uint32),
    }
    try:
        channel.initialise(inputs(channel, values))
        channel.step(inputs(channel, values), 0, 10_000_000)
        outputs = channel.outputs()
        assert np.asarray(outputs["probe.vehicle_loss"]).tolist() == [0.0, 0.0]
        assert np.asarray(outputs["probe.link"]).tolist() == [0, 0], "LOS"
    finally:
        channel.close()


@pytest.mark.slow
def test_in_full_load_every_fragment_waits_and_pays_on_each_hop(tmp_path: Path) -> None:
    """Compression 16 over one relay wants twice what 6 Mbit/s carry: frames expire."""
    traces = run(
        "red_light_full_load.yaml",
        tmp_path / "run",
        "4 s",
        **EARLY,
        **ONLY_THE_UNIT,
        **{
            "components.traffic.parameters.entities.rsu.type": "roadside_unit",
            "components.traffic.parameters.entities.rsu.position": "{x: 14 m, y: 9 m}",
            "components.facilities.parameters.compression": "16",
        },
    )
    sent = traces.packets[traces.packets["kind"] == SENSOR_DATA]
    _, size = np.unique(sent["time"], return_inverse=True)
    assert set(np.bincount(size, weights=sent["size"])) == {67_072}
    frames = table(traces, "channel.transmissions", "SENT", TRANSMISSION)
    frames = frames[frames["kind"] == SENSOR_DATA]
    on_air = frames[frames["fate"] == 0]
    expired = frames[frames["fate"] == 2]
    assert (on_air["time"] - on_air["queued"]).max() <= 100_000_000
    assert len(expired) > 100
    assert (expired["time"] - expired["queued"]).min() >= 100_000_000
    assert (on_air["duration"] > 1_900_000).all(), "1.4 kB at 6 Mbit/s"
    heard = traces.receptions
    relayed = heard[
        (heard["receiver"] == UNIT) & (heard["addressed"] == 1) & (heard["outcome"] == 0)
    ]
    second = frames[frames["hop"] == 1]
    in_time = relayed["time"] < traces.end - 300_000_000
    assert np.isin(relayed["packet"][in_time], second["packet"]).all()
    busy = np.asarray(traces.series("channel.busy_ratio")[-1])
    assert busy.max() > 0.8
