"""A network in the loop: the same bits wherever components run."""

import json
from pathlib import Path

import pytest

from fmus.driving.network.architecture import Architecture
from orchestrator.cli import main
from tests.fmus.driving.network.world import network

SCENARIO = Path(__file__).parents[2] / "scenarios" / "red_light_driving.yaml"


def fingerprint(
    capsys: pytest.CaptureFixture[str], out: Path, checkpoint: Path, stop: str, transport: str
) -> str:
    settings = [
        f"time.stop={stop}",
        f"components.encoder.parameters.network={checkpoint}",
        f"components.policy.parameters.network={checkpoint}",
    ]
    options = [text for setting in settings for text in ("--set", setting)]
    options += ["--no-figure", "--set", "measures={}"]
    command = ["run", str(SCENARIO), *options, "--transport", transport, "--out", str(out)]
    assert main([*command, "--json", "--quiet"]) == 0
    found: str = json.loads(capsys.readouterr().out)["fingerprint"]
    return found


@pytest.fixture
def checkpoint(tmp_path: Path) -> Path:
    """Of random weights, with the message sizes of `bev-32`."""
    path = tmp_path / "random.safetensors"
    network(Architecture(keypoints=32, features=256, spacing=6)).write(path)
    return path


@pytest.mark.slow
def test_a_network_drives_alike_wherever_components_run(
    tmp_path: Path, checkpoint: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prints = {
        transport: fingerprint(capsys, tmp_path / transport, checkpoint, "4 s", transport)
        for transport in ("in-process", "loopback", "local", "zenoh")
    }
    assert len(set(prints.values())) == 1, prints


@pytest.mark.slow
def test_a_network_drives_alike_twice(
    tmp_path: Path, checkpoint: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And another one drives otherwise."""
    prints = [
        fingerprint(capsys, tmp_path / name, checkpoint, "500 ms", transport)
        for name, transport in (("a", "in-process"), ("b", "loopback"))
    ]
    assert prints[0] == prints[1]
    network(Architecture(keypoints=32, features=256, spacing=6), seed=1).write(checkpoint)
    assert fingerprint(capsys, tmp_path / "c", checkpoint, "500 ms", "in-process") != prints[0]
