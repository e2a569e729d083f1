"""Learning with a point transformer: the network trained is the network that drives."""

import dataclasses
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml

from fmus.driving.network.checkpoint import read_network
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.driver import DrivingNetwork, ego_numbers
from fmus.driving.network.messages import seen, to_message, to_observed
from fmus.driving.network.point_transformer import recorded_points
from fmus.driving.network.scan import scan_of
from fmus.driving.network.sensors import sensor_encoder
from fmus.physics.plane import Frame
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array
from studies.training.collector import Dagger
from studies.training.learner import Optimisation, RecordedRun, create_learner, learner_type
from studies.training.learning.batches import Delivered
from studies.training.learning.cloud_lessons import CloudLessons, cloud_batch_of, cloud_lessons
from studies.training.learning.cloud_model import CloudDrivingModel
from studies.training.learning.point_transformer import PointTransformerParameters
from studies.training.learning.sample import BODY, Sample, read_sample, write_sample
from tests.fmus.driving.network.transformers import architecture, cloud, network

EGO, OTHER = 7, 9
POINTS = 256
RECIPES = Path(__file__).parents[3] / "studies" / "training" / "recipes"
EPOCHS = 6
ROUTE = np.array([[0.0, 0.0], [30.0, 4.0], [60.0, 30.0]])


def sample_of(clouds: Sequence[Cloud], time: int, *, frame: Frame, expert: Array) -> Sample:
    """As `policy-dagger` makes it."""
    return Sample(
        time=time,
        ego=EGO,
        frame=frame,
        numbers=ego_numbers(frame, 6.0, 8.0, ROUTE),
        expert=expert,
        threat=-1,
        scans=tuple(map(scan_of, clouds)),
        bodies=np.zeros(0, BODY),
        most_points=POINTS,
        points=tuple(recorded_points(each, POINTS) for each in clouds),
    )


def moment(k: int, points: tuple[int, int] = (150, 190)) -> tuple[list[Cloud], Sample]:
    """Clouds of the ego and of another, and the sample of them; all of their points are read."""
    time = 100_000_000 * (k + 1)
    ego = Frame(x=3.0 + k, y=0.5, heading=0.1 * k)
    other = Frame(x=25.0 + k, y=-9.0, heading=2.0 - 0.3 * k)
    clouds = [
        cloud(points[0], seed=2 * k, reach=60 - 7 * k, vehicle=EGO, time=time, frame=ego),
        cloud(points[1], seed=2 * k + 1, reach=50, vehicle=OTHER, time=time, frame=other),
    ]
    expert = np.array([0.2, 0.0, 0.0])
    return clouds, read_sample(write_sample(sample_of(clouds, time, frame=ego, expert=expert)))


def moderate(weights: Mapping[str, Array]) -> dict[str, Array]:
    """Weights with which commands lie within their limits."""
    weight, bias = weights["head.second.weight"].copy(), weights["head.second.bias"].copy()
    weight[:, :2] *= 0.1
    bias[:2] = 0.1, 0.4
    return {**weights, "head.second.weight": weight, "head.second.bias": bias}


def limited(command: Array) -> Array:
    """As `Head.command`."""
    accelerate, brake, steer = command.tolist()
    accelerate, brake = min(max(accelerate, 0.0), 1.0), min(max(brake, 0.0), 1.0)
    pedals = (0.0, brake) if brake >= accelerate else (accelerate, 0.0)
    return np.array([*pedals, min(max(steer, -1.0), 1.0)])


@pytest.mark.parametrize("features", [128, 256])
def test_the_command_in_training_is_that_of_driving(features: int) -> None:
    """Encoder in PyTorch, then fusion and head in fixed point and in floating point.

    From the same clouds, one by the sample and one by the message: some keypoints of which
    are lost. The numbers are rounded to 2^-8 after each of four layers.
    """
    shape = architecture(16, features)
    stored = network(shape, seed=3)
    stored = dataclasses.replace(stored, weights=moderate(stored.weights))
    model = CloudDrivingModel(shape, seed=1)
    model.load(stored.weights)
    model.eval()
    drives = DrivingNetwork(shape, stored.weights)
    rng = np.random.default_rng(0)
    found, expected = [], []
    for k in range(8):
        clouds, sample = moment(k)
        sample = dataclasses.replace(sample, most_points=shape.points)
        known = cloud_lessons([sample], shape)
        kept = rng.random((1, 2, shape.keypoints)) < 0.6
        kept[:, 0] = True
        arrived = Delivered(scans=np.array([[0, 1]]), keypoints=kept)
        batch = cloud_batch_of(known, known.moments, arrived, rng, torch.device("cpu"))
        with torch.no_grad():
            found.append(limited(model(batch)[0].numpy()))
        own, other = clouds
        message = to_message(other, sensor_encoder(stored).encode(other), shape, stored.encoder)
        partial = dataclasses.replace(
            message, keypoints=message.keypoints[kept[0, 1, : len(message.keypoints)]]
        )
        observed = [
            seen(own, sensor_encoder(stored).encode(own), sample.time),
            to_observed(partial, sample.time),
        ]
        frame = sample.frame
        command = drives.drive(observed, frame=frame, speed=6.0, wanted_speed=8.0, route=ROUTE)
        expected.append(command)
    np.testing.assert_allclose(found, expected, atol=0.02)
    assert np.ptp(expected, axis=0)[2] > 0.2  # the steering at least is not the same throughout


def test_samples_keep_their_points() -> None:
    _, sample = moment(1)
    again = read_sample(write_sample(sample))
    assert [len(points) for points in again.points] == [150, 190]
    for points, expected in zip(again.points, sample.points, strict=True):
        assert np.array_equal(points, expected)
    without = read_sample(write_sample(dataclasses.replace(sample, most_points=0, points=())))
    assert without.points == ()
    with pytest.raises(ValueError, match="another number of cells or points than its scans"):
        read_sample(write_sample(sample)[:-2])


def test_of_scans_that_nobody_has_no_keypoint_is_present() -> None:
    """The command is then that of the ego's numbers alone, whatever the clouds are."""
    shape = architecture()
    model = CloudDrivingModel(shape, seed=1).eval()
    rng = np.random.default_rng(0)

    def command(k: int, scans: list[int]) -> Array:
        known = cloud_lessons([moment(k)[1], moment(1)[1]], shape)
        arrived = Delivered(scans=np.array([scans]), keypoints=np.ones((1, 2, 16), bool))
        batch = cloud_batch_of(known, known.moments[1:], arrived, rng, torch.device("cpu"))
        with torch.no_grad():
            answer: Array = model(batch).numpy()
        return answer

    assert np.array_equal(command(2, [-1, -1]), command(3, [-1, -1]))
    assert not np.array_equal(command(2, [-1, 1]), command(3, [-1, -1]))


def test_others_are_known_by_their_newest_scans() -> None:
    known = cloud_lessons([moment(k)[1] for k in range(4)], architecture())
    assert known.moments["own"].tolist() == [0, 2, 4, 6]
    assert known.moments["others"][3, :5].tolist() == [7, 5, 3, 1, -1]
    both = CloudLessons.of([known, known])
    assert both.moments["own"][4:].tolist() == [8, 10, 12, 14]
    assert both.moments["others"][7, :5].tolist() == [15, 13, 11, 9, -1]
    alone = cloud_lessons([moment(k)[1] for k in range(4)], architecture(cooperative=False))
    assert alone.moments["own"].tolist() == [0, 1, 2, 3]
    assert (alone.moments["others"] == -1).all()


def test_samples_with_too_few_points_are_refused() -> None:
    with pytest.raises(
        ValueError, match="at most 256 points of a scan, and this network reads 204"
    ):
        cloud_lessons([moment(0)[1]], architecture(128))
    none = dataclasses.replace(moment(0)[1], most_points=0, points=())
    with pytest.raises(ValueError, match=re.escape("components.policy.parameters.points")):
        cloud_lessons([none], architecture())
    with pytest.raises(ValueError, match="no scan of a run has a point"):
        cloud_lessons([moment(0, (0, 0))[1]], architecture())


def ahead(k: int, seed: int) -> Sample:
    """The expert brakes in every second moment, where something stands ahead of the ego."""
    rng = np.random.default_rng([seed, k])
    is_blocked = bool(k % 2)
    frame = Frame(x=0.0, y=0.0, heading=0.0)
    scan = cloud(200, seed=1000 * seed + k, reach=20, vehicle=EGO, time=k, frame=frame)
    x, y = scan.x.copy(), scan.y.copy()
    x[np.abs(y) < 4.0] *= -np.sign(x[np.abs(y) < 4.0])  # nothing is ahead, but
    if is_blocked:
        x[:40], y[:40] = rng.uniform(8.0, 14.0, 40), rng.uniform(-2.0, 2.0, 40)
    scan = dataclasses.replace(scan, x=x, y=y)
    expert = np.array([0.0, 0.8, 0.0]) if is_blocked else np.array([0.5, 0.0, 0.0])
    return sample_of([scan], k, frame=frame, expert=expert)


def runs(count: int, first: int = 0) -> list[RecordedRun]:
    return [
        RecordedRun(
            seed=first + seed,
            levels={},
            samples=tuple(write_sample(ahead(k, first + seed)) for k in range(20)),
        )
        for seed in range(count)
    ]


def learner(**given: Any) -> Any:
    optimisation = Optimisation(epochs=EPOCHS, batch=4, rate=2e-3, weight_decay=1e-5, patience=9)
    values = {"keypoints": 16, "features": 128, **given}
    return create_learner(learner_type("point-transformer"), values, optimisation, 3, "cpu")


@pytest.mark.slow
def test_it_learns_to_brake_for_what_is_ahead(tmp_path: Path) -> None:
    """A network without eyes has a loss of 0.65 at best: whatever it does, half is wrong."""
    student = learner(yielding_weight=1.0)
    student.add(runs(3))
    student.add_validation(runs(1, first=50))
    student.begin_round(0)
    results = [student.epoch() for _ in range(EPOCHS)]
    assert results[-1].validation < 0.25
    student.export(tmp_path / "a.safetensors")
    stored = read_network(str(tmp_path / "a.safetensors"))
    assert stored.origin["learner"] == "point-transformer"
    drives = DrivingNetwork(stored.architecture, stored.weights)
    encoder = sensor_encoder(stored)
    for k in range(10):
        sample = ahead(k, seed=90)
        points = sample.points[0].astype(np.float32) / 100
        scan = dataclasses.replace(
            cloud(1, vehicle=EGO, time=k), x=points[:, 0], y=points[:, 1], z=points[:, 2]
        )
        observed = [seen(scan, encoder.encode(scan), k)]
        frame = sample.frame
        command = drives.drive(observed, frame=frame, speed=6.0, wanted_speed=8.0, route=ROUTE)
        assert (command[1] > 0.4) == bool(k % 2), command


def test_going_on_is_as_never_having_stopped() -> None:
    """Statistics of the batch normalisation are part of the state."""
    whole, parts = learner(), learner()
    for student in (whole, parts):
        student.add(runs(1))
        student.add_validation(runs(1, first=50))
        student.begin_round(0)
    whole.epoch()
    state = whole.state()
    expected = whole.epoch()
    parts.restore(state)
    assert parts.epoch() == expected
    assert parts.state() == whole.state()
    with pytest.raises(ValueError, match="this is no state of such a network"):
        learner(features=256).restore(state)


def test_shapes_that_there_are_not_are_refused() -> None:
    with pytest.raises(ValueError, match="`features` are 64; they must be 128 or 256"):
        learner(features=64)


def test_points_without_pytorch_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ComponentTypeError, match=re.escape("or write `points: 0`")):
        Dagger(Dagger.Parameters(points=100))
    Dagger(Dagger.Parameters())


@pytest.mark.parametrize(("compression", "size"), [(16, 67_072), (32, 33_152)])
def test_recipes_are_of_the_published_sizes_in_the_scenes_of_the_others(
    compression: int, size: int
) -> None:
    """And record as many points as the network reads."""
    own = yaml.safe_load((RECIPES / f"point_transformer_{compression}.yaml").read_text())
    other = yaml.safe_load((RECIPES / f"bev_{compression}.yaml").read_text())
    network = {name: value for name, value in own["network"].items() if name != "type"}
    shape = PointTransformerParameters(**network).architecture
    assert 4 * shape.keypoints * (3 + shape.dimensions) == size
    ((points,),) = (each.values() for each in own["scenes"].pop("cloud").values())
    assert points == shape.points == 2048
    assert own["scenes"] == other["scenes"]
    assert own["scenario"] == other["scenario"]
    assert own["seed"] != other["seed"]
