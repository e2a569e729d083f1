"""The whole loop with the point transformer: the expert drives, it learns, it drives."""

from pathlib import Path

import numpy as np
import pytest

import scenarios
from fmus.driving.network.checkpoint import read_network
from fmus.messages.features import read_features
from orchestrator.campaign.conduct import Options
from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.training import figure
from studies.training.conduct import conduct_training
from studies.training.load import load_training
from tests.workers import HereAndNow

SCENARIOS = Path(scenarios.__file__).parent
TRAINING = f"""
schema: 1
scenario: {SCENARIOS / "red_light_training.yaml"}
seed: 5
network: {{type: point-transformer, keypoints: 16, features: 128}}
scenes:
  cloud: {{256 points: {{components.policy.parameters.points: 256}}}}
  length: {{6 s: {{time.stop: 6 s}}}}
expert: {{runs: 2}}
dagger: {{rounds: 0, runs: 1}}
validation: {{runs: 1}}
optimisation: {{epochs: 1, batch: 4, rate: 1e-3, patience: 1}}
device: cpu
checkpoint: tiny.safetensors
"""
MESSAGE_BYTES = 16 * (3 + 128) * 4


def driven(folder: Path, name: str) -> Recording:
    """Of 4.5 s with the network; sensor data are shared from 3 s on."""
    network = folder / "tiny.safetensors"
    arguments = ["run", str(SCENARIOS / "red_light_driving.yaml"), "--quiet", "--no-figure"]
    arguments += ["--transport", "in-process", "--out", str(folder / name)]
    for setting in (
        f"components.encoder.parameters.network={network}",
        f"components.policy.parameters.network={network}",
        "components.facilities.parameters.load=full",
        "time.stop=4.5 s",
        "recording.exclude=[lidar.points]",
    ):
        arguments += ["--set", setting]
    assert main(arguments) == 0
    return Recording(folder / name)


def commands(recording: Recording) -> Array:
    return np.array(list(recording["policy.command"]))


@pytest.mark.slow
def test_it_learns_from_the_expert_and_drives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figure, "draw", lambda found, directory: None)
    (tmp_path / "training.yaml").write_text(TRAINING)
    options = Options(
        out=tmp_path / "out",
        pool=HereAndNow().pool,
        resume=False,
        progress=False,
        command="nlosim train training.yaml",
        check=lambda: None,
    )
    outcome = conduct_training(load_training(tmp_path / "training.yaml"), options)
    (epoch,) = outcome.findings.epochs
    assert 0.0 < epoch["validation_loss"] < 1.0
    assert read_network(str(tmp_path / "tiny.safetensors")).architecture.points == 256

    recording = driven(tmp_path, "run")
    messages = [read_features(bytes(each)) for each in recording["encoder.features"]]
    assert all(m.size == MESSAGE_BYTES for each in messages for m in each)
    received = [read_features(bytes(each)) for each in recording["facilities.received.features"]]
    assert not received[0]
    assert received[-1]  # and the network drove with them
    found = commands(recording)
    assert np.ptp(found[1:], axis=0).max() > 0.0
    assert driven(tmp_path, "again").fingerprint() == recording.fingerprint()
