"""The learner of BEV networks, and its model beside the network that drives."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import torch

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint, read_network
from fmus.driving.network.driver import Head
from fmus.driving.network.encoder import BevEncoder
from fmus.driving.network.fixed_point import rounded
from fmus.driving.network.fusion import Fusion, Observed
from fmus.driving.network.patches import History
from orchestrator.signal import Array
from studies.training.learner import Optimisation, RecordedRun, create_learner, learner_type
from studies.training.learning.batches import Batch, Delivered, batch_of
from studies.training.learning.bev import BevLearner, BevParameters
from studies.training.learning.lessons import lessons
from studies.training.learning.model import DrivingModel
from studies.training.learning.sample import write_sample
from tests.fmus.driving.network.world import network
from tests.studies.training.lessons_world import run, sample

PLAN: Final = Optimisation(epochs=12, batch=8, rate=0.01, weight_decay=1e-5, patience=3)
SHAPE: Final[dict[str, Any]] = {
    "keypoints": 16,
    "features": 12,
    "vectors": 4,
    "hidden": 16,
    "fused": 16,
    "pooled": 16,
    "head": 16,
}


def learner(seed: int = 1, runs: tuple[int, ...] = (1, 2), **parameters: Any) -> BevLearner:
    """At the beginning of the first round."""
    made = BevLearner(BevParameters(**SHAPE | parameters), PLAN, seed, "cpu")
    made.add_validation([run(9)])
    made.add(map(run, runs))
    made.begin_round(0)
    return made


def everything_of(samples: int, architecture: Architecture) -> Batch:
    """The last moment of a run with its own scan and the one before of the sharer; all arrive."""
    known = lessons(
        [sample(k) for k in range(1, samples + 1)], architecture, np.random.default_rng(0)
    )
    moments = known.moments[-1:]
    scans = np.array([[moments["own"][0], moments["others"][0, 1]]])
    arrived = np.ones((1, 2, architecture.keypoints), np.bool_)
    columns = np.arange(architecture.keypoints)
    device = torch.device("cpu")
    return batch_of(known, moments, Delivered(scans=scans, keypoints=arrived), columns, device)


def driven(samples: int, checkpoint: Checkpoint) -> Array:
    """Accelerate, brake, steer at that moment, by the network that drives."""
    encoder = BevEncoder(checkpoint.architecture, checkpoint.weights)
    histories = [History(), History()]
    keypoints = []
    for k in range(1, samples + 1):
        for history, scan in zip(histories, sample(k).scans, strict=True):
            history.add(scan)
        found = [encoder.encode(history.stack) for history in histories]
        keypoints.append(list(zip(sample(k).scans, found, strict=True)))
    last = sample(samples)
    observed = []
    for own, (scan, seen) in ((True, keypoints[-1][0]), (False, keypoints[-2][1])):
        observed.append(
            Observed(
                frame=scan.frame,
                x=rounded(seen.x),
                y=rounded(seen.y),
                z=rounded(seen.z),
                features=seen.features,
                age=(last.time - scan.time) / 1e9,
                own=own,
            )
        )
    speed = 8.0 * float(last.numbers[0])
    fused = Fusion(checkpoint.architecture, checkpoint.weights).fuse(observed, last.frame, speed)
    head = Head(checkpoint.architecture, checkpoint.weights)
    return head.command(fused, rounded(last.numbers))


@pytest.mark.parametrize("seed", range(4))
def test_the_network_that_drives_is_the_model_that_learned(seed: int) -> None:
    """With all places as keypoints, so that both have the same: to 0.03 of the full command."""
    architecture = Architecture(keypoints=500, features=64)
    checkpoint = network(architecture, seed)
    model = DrivingModel(architecture)
    model.layers.load(checkpoint.weights)
    batch = everything_of(5, architecture)
    with torch.no_grad():
        raw = model(batch.seen, batch.ego).command[0].double().numpy()
    pedals = np.clip(raw[:2], 0.0, 1.0)
    found = driven(5, checkpoint)
    assert found[2] == pytest.approx(np.clip(raw[2], -1.0, 1.0), abs=0.03)
    assert found[:2].max() == pytest.approx(pedals.max(), abs=0.03)
    if abs(pedals[0] - pedals[1]) > 0.06:  # else rounding may choose the other one
        assert found[:2].argmax() == pedals.argmax()


@pytest.mark.slow
def test_learning_makes_the_loss_small() -> None:
    """Runs that it learned from, and one that it did not."""
    made = learner()
    first = made.epoch()
    for _ in range(11):
        last = made.epoch()
    assert last.training < 0.5 * first.training
    assert last.validation < 0.6 * first.validation
    assert last.parts["vehicle"] > 0.8
    assert set(last.parts) == {"accelerate", "brake", "steer", "vehicle", "truth"}


def test_equal_seeds_learn_equally_and_others_do_not() -> None:
    one, other, third = learner(1), learner(1), learner(2)
    results = [(each.epoch(), each.epoch()) for each in (one, other, third)]
    assert results[0] == results[1] != results[2]
    assert one.state() == other.state() != third.state()


def test_a_restored_learner_goes_on_as_if_nothing_had_been() -> None:
    whole = learner()
    whole.epoch()
    whole.epoch()
    saved = whole.state()
    expected = [whole.epoch(), whole.epoch()]
    other = learner(runs=(1, 2))
    other.restore(saved)
    assert other.state() == saved
    assert [other.epoch(), other.epoch()] == expected
    assert other.state() == whole.state()


def test_validation_does_not_depend_on_the_epoch() -> None:
    """Without learning, the same number again: the same messages are lost every time."""
    idle = BevLearner(BevParameters(**SHAPE), replace(PLAN, rate=0.0, weight_decay=0.0), 1, "cpu")
    idle.add_validation([run(9)])
    idle.add([run(1)])
    one, other = idle.epoch(), idle.epoch()
    assert one.validation == other.validation
    assert one.training != other.training


def test_a_state_of_another_network_is_refused() -> None:
    other = learner(hidden=8).state()
    for state in (other, b"nonsense", other[:-1]):
        with pytest.raises(ValueError, match="this is no state of such a network"):
            learner().restore(state)


def test_a_checkpoint_has_the_weights_that_were_learned(tmp_path: Path) -> None:
    made = learner()
    made.epoch()
    path = tmp_path / "a.safetensors"
    made.export(path)
    found = read_network(str(path))
    assert found.architecture == BevParameters(**SHAPE).architecture
    assert found.origin == {"learner": "bev", "seed": "1", "round": "0"}
    again = tmp_path / "b.safetensors"
    learned = learner()
    learned.epoch()
    learned.export(again)
    assert again.read_bytes() == path.read_bytes()
    model = DrivingModel(found.architecture)
    model.layers.load(found.weights)
    assert all((value == found.weights[n]).all() for n, value in model.layers.weights().items())


@pytest.mark.parametrize(
    "parameters", [{"cooperative": False}, {"early": True}, {"looked_at": 5}, {"messages": 1}]
)
def test_variants_learn(parameters: dict[str, Any]) -> None:
    made = learner(**parameters)
    first = made.epoch()
    for _ in range(5):
        last = made.epoch()
    assert last.training < first.training
    assert np.isfinite([last.training, last.validation, *last.parts.values()]).all()


def test_moments_at_which_nothing_is_seen_are_no_harm() -> None:
    """No place in a whole batch: there is still a command to learn, and every loss is a number."""
    unseen = [
        replace(each, scans=tuple(replace(s, cells=s.cells[:0]) for s in each.scans))
        for each in (sample(k) for k in range(1, 9))
    ]
    empty = RecordedRun(seed=1, levels={}, samples=tuple(map(write_sample, unseen)))
    made = BevLearner(BevParameters(**SHAPE), PLAN, 1, "cpu")
    made.add_validation([empty])
    made.add([empty])
    made.begin_round(0)
    found = [made.epoch() for _ in range(3)][-1]
    assert np.isfinite([found.training, found.validation, *found.parts.values()]).all()
    assert found.parts["truth"] == 0.0


def test_sizes_that_make_no_network_are_refused_before_anything_is_driven() -> None:
    with pytest.raises(ValueError, match="too few for 16 `vectors`"):
        create_learner(learner_type("bev"), {"features": 30}, PLAN, 1, "cpu")


def test_there_is_nothing_to_learn_without_samples() -> None:
    made = BevLearner(BevParameters(**SHAPE), PLAN, 1, "cpu")
    with pytest.raises(RuntimeError, match="nothing to learn from"):
        made.epoch()
