"""The policy that drives while samples are recorded."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.driving.network.cloud import clouds
from fmus.driving.network.driver import ego_numbers
from fmus.driving.network.scan import scan_of
from fmus.driving.policy.command import Command
from fmus.driving.policy.connectors import INPUTS
from fmus.driving.policy.expert import Expert, ExpertDriver, ExpertParameters
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.network import NetworkDriver
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.physics.plane import Frame
from orchestrator.signal import Array, Signal, Signals
from orchestrator.testing import check_component
from studies.training.collector import Dagger
from studies.training.learning.sample import Sample, read_sample
from tests.fmus.driving.network.world import (
    SMALL,
    changed,
    network,
    turn,
)

STEP = 50_000_000
SECOND = 1_000_000_000
EGO, OTHER = 4, 9


def points(k: int) -> bytes:
    """The scans of both vehicles at the time number `k`."""
    return turn(k, {EGO: (0.8 * k, 0.0), OTHER: (15.0, 5.0)}, alike=True)


def inputs(step: int) -> dict[str, Signal]:
    """At step number `step`; the lidars scan at every other one."""
    k, x = step // 2, 0.4 * step
    return {
        "ego.id": np.array(EGO),
        "ego.position": np.array([x, 0.0]),
        "ego.heading": np.array(0.02),
        "ego.speed": np.array(8.0),
        "ego.size": np.array([4.4, 1.8, 1.5]),
        "ego.route": np.array([[x, 0.0], [x + 40.0, 3.0]]),
        "points": points(k),
        "objects": b"",
        "received.objects": b"",
        "received.features": b"",
        "vehicle.id": np.array([EGO, OTHER]),
        "vehicle.position": np.array([[x, 0.0, 0.0], [15.0, 5.0, 0.0]]),
        "vehicle.heading": np.array([0.02, 1.0]),
        "vehicle.velocity": np.array([[8.0, 0.0], [0.0, 0.0]]),
        "vehicle.size": np.array([[4.4, 1.8, 1.5], [9.0, 2.4, 3.4]]),
        "pose_error.vehicle": np.zeros(0, np.int64),
        "pose_error.position": np.zeros((0, 2)),
        "pose_error.heading": np.zeros(0),
    }


MOMENTS = [inputs(step) for step in range(61)]
UNSEEN = [moment | {"points": b""} for moment in MOMENTS]
"""The same without lidars, which is quicker."""


def behind_who_is_slow(step: int) -> dict[str, Signal]:
    """On a straight road, without lidars; the ego vehicle stays in its lane whatever it should."""
    x = 0.4 * step
    return inputs(step) | {
        "points": b"",
        "ego.heading": np.array(0.0),
        "ego.route": np.array([[x, 0.0], [x + 200.0, 0.0]]),
        "vehicle.position": np.array([[x, 0.0, 0.0], [20.0 + 0.15 * step, 0.0, 0.0]]),
        "vehicle.heading": np.zeros(2),
        "vehicle.velocity": np.array([[8.0, 0.0], [3.0, 0.0]]),
    }


def collector(folder: Path, *, with_network: bool = True, **parameters: Any) -> Dagger:
    if with_network:
        path = folder / "a.safetensors"
        network().write(path)
        parameters["network"] = str(path)
    return Dagger(Dagger.Parameters(**parameters))


def drive(
    component: Dagger, seed: int = 0, moments: Sequence[Signals] = MOMENTS
) -> list[dict[str, Signal]]:
    component.setup(0, np.random.default_rng(seed))
    outputs = []
    for step, moment in enumerate(moments[1:]):
        component.step(moment, step * STEP, STEP)
        outputs.append(dict(component.outputs()))
    return outputs


def commands(outputs: list[dict[str, Signal]]) -> Array:
    return np.array([each["command"] for each in outputs])


def known(moment: Signals) -> Inputs:
    return Inputs.read(moment, frozenset(INPUTS))


def taught() -> list[Command]:
    expert = ExpertDriver(ExpertParameters())
    return [expert.drive(known(moment)) for moment in MOMENTS[1:]]


def by_expert() -> Array:
    return np.array([command.signals()["command"] for command in taught()])


def expert_threats() -> list[int]:
    return [command.hazard.instance if command.hazard else -1 for command in taught()]


def by_network(moments: Sequence[Signals] = MOMENTS) -> Array:
    driver = NetworkDriver(network_as_stored(), 30.0 / 3.6, SECOND)
    return np.array([driver.command(known(m), (k + 1) * STEP) for k, m in enumerate(moments[1:])])


def network_as_stored() -> Any:
    stored = network()
    weights = {n: w.astype(np.float32).astype(float) for n, w in stored.weights.items()}
    return type(stored)(architecture=SMALL, weights=weights, origin={})


def samples(outputs: list[dict[str, Signal]]) -> dict[int, Sample]:
    """By the number of the step that made them, from 1 on."""
    return {
        k + 1: read_sample(bytes(each["sample"]))
        for k, each in enumerate(outputs)
        if each["sample"]
    }


def test_the_expert_drives_with_beta_1_and_the_network_with_beta_0(tmp_path: Path) -> None:
    assert (commands(drive(collector(tmp_path, with_network=False))) == by_expert()).all()
    assert (commands(drive(collector(tmp_path, beta=1.0))) == by_expert()).all()
    driven = commands(drive(collector(tmp_path, beta=0.0)))
    assert (driven == by_network()).all()
    assert (driven != by_expert()).any(axis=1).all()


def test_the_expert_overtakes_if_it_may(tmp_path: Path) -> None:
    """And remembers from step to step how far it has got, as the policy does."""
    moments = [behind_who_is_slow(step) for step in range(40)]
    given = Overtaking(patience=0.0)
    expert = Expert(ExpertParameters(overtaking=given))
    expert.begin(0, np.random.default_rng(0))
    wanted = [
        expert.drive(known(m), (k + 1) * STEP).signals()["command"]
        for k, m in enumerate(moments[1:])
    ]
    driven = commands(
        drive(collector(tmp_path, with_network=False, overtaking=given), moments=moments)
    )
    assert (driven == np.array(wanted)).all()
    assert (driven[:, 2] > 0.0).all()
    assert driven[:, 2].max() > 0.1
    kept = commands(drive(collector(tmp_path, with_network=False), moments=moments))
    assert (kept[:, 2] == 0.0).all()


@pytest.mark.slow
def test_they_take_turns(tmp_path: Path) -> None:
    """Each turn is one's as a whole; the share of the expert's is beta."""
    expert, learned = by_expert(), by_network(UNSEEN)
    shares = []
    for seed in range(40):
        driven = commands(drive(collector(tmp_path, beta=0.3, turn=0.5), seed, UNSEEN))
        is_expert = (driven == expert).all(axis=1)
        assert (is_expert | (driven == learned).all(axis=1)).all()
        turns = is_expert.reshape(6, 10)
        assert (turns.all(axis=1) | ~turns.any(axis=1)).all()
        shares.append(turns.mean())
    assert np.mean(shares) == pytest.approx(0.3, abs=0.1)  # 240 turns: three standard deviations


@pytest.mark.slow
def test_the_wheel_is_pulled_in_some_turns_and_the_expert_does_not_say_so(tmp_path: Path) -> None:
    expert = by_expert()
    component = collector(tmp_path, with_network=False, disturbance=0.5, disturbance_angle=0.2)
    pulls = []
    for seed in range(40):
        driven = commands(drive(component, seed, UNSEEN))
        assert (driven[:, :2] == expert[:, :2]).all()
        pull = (driven - expert)[:, 2].reshape(3, 20)
        assert np.ptp(pull, axis=1).max() < 1e-12
        pulls += pull[:, 0].tolist()
    assert 0.0 < np.abs(pulls).max() <= 0.2
    assert min(pulls) < 0.0 < max(pulls)
    assert np.mean(np.abs(pulls) > 0.0) == pytest.approx(0.5, abs=0.14)  # 120 turns
    disturbed = drive(component, int(np.argmax(np.abs(pulls))) // 3)
    assert (commands(disturbed) != expert).any()
    for step, sample in samples(disturbed).items():
        assert (sample.expert == expert[step - 1]).all()


@pytest.mark.slow
@pytest.mark.parametrize("beta", [0.0, 1.0])
def test_every_scan_is_one_sample_with_the_truth_of_its_moment(tmp_path: Path, beta: float) -> None:
    expert = by_expert()
    assert set(expert_threats()) == {-1, OTHER}
    found = samples(drive(collector(tmp_path, beta=beta)))
    assert list(found) == list(range(2, 61, 2))
    for step, sample in found.items():
        moment = MOMENTS[step]
        frame = Frame(x=0.4 * step, y=0.0, heading=0.02)
        assert (sample.time, sample.ego, sample.frame) == (step * STEP, EGO, frame)
        assert (sample.expert == expert[step - 1]).all()
        route = np.asarray(moment["ego.route"])
        assert sample.threat == expert_threats()[step - 1]
        assert (sample.numbers == ego_numbers(frame, 8.0, 30.0 / 3.6, route)).all()
        scans = [scan_of(cloud) for cloud in clouds(bytes(moment["points"]))]
        assert [s.vehicle for s in sample.scans] == [EGO, OTHER]
        assert all((a.cells == b.cells).all() for a, b in zip(sample.scans, scans, strict=True))
        assert sample.bodies["number"].tolist() == [EGO, OTHER]
        assert sample.bodies["place"].tolist() == [[0.4 * step, 0.0, 0.02], [15.0, 5.0, 1.0]]
        assert sample.bodies["size"].tolist() == [[4.4, 1.8], [9.0, 2.4]]
        assert sample.bodies["velocity"].tolist() == [[8.0, 0.0], [0.0, 0.0]]


def test_without_a_route_there_is_no_sample(tmp_path: Path) -> None:
    component = collector(tmp_path)
    component.setup(0, np.random.default_rng(0))
    component.step(MOMENTS[2] | {"ego.route": np.zeros((0, 2))}, STEP, STEP)
    assert component.outputs()["sample"] == b""


@pytest.mark.parametrize("which", ["expert", "cooperative", "alone"])
def test_it_reads_what_its_outputs_depend_on_and_nothing_else(tmp_path: Path, which: str) -> None:
    path = tmp_path / "a.safetensors"
    network(changed(cooperative=which == "cooperative")).write(path)
    name = "" if which == "expert" else str(path)
    component = Dagger(Dagger.Parameters(network=name))
    reads = component.connectors["command"].feedthrough
    assert ("received.features" in reads) == (which == "cooperative")
    assert component.connectors["sample"].feedthrough <= reads
    for lacking in [set(), *({name} for name in reads)]:
        component.setup(0, np.random.default_rng(0))
        given = {n: MOMENTS[2][n] for n in reads - lacking}
        if lacking:
            with pytest.raises(KeyError, match=min(lacking)):
                component.step(given, STEP, STEP)
        else:
            component.step(given, STEP, STEP)


def test_contract(tmp_path: Path) -> None:
    check_component(
        collector(tmp_path, beta=0.5, turn=0.1, disturbance=0.5),
        steps=8,
        h=STEP,
        seed=3,
        inputs=lambda t: MOMENTS[t // STEP],
    )
