"""A network in the loop: the same bits wherever components run."""

import json
from pathlib import Path

import pytest

from fmus.driving.network.architecture import Architecture
from orchestrator.cli import main
from orchestrator.input_files import digest
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.inputs import digests
from tests.fmus.driving.network.world import network

SCENARIO = Path(__file__).parents[2] / "scenarios" / "red_light_driving.yaml"

MINE = f"""\
schema: 1
extends: {SCENARIO}
title: Mine
components:
  encoder: {{{{parameters: {{{{network: {{network}}}}}}}}}}
  policy: {{{{parameters: {{{{network: {{network}}}}}}}}}}
"""


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


def test_a_network_of_ones_own_lies_beside_the_scenario(
    tmp_path: Path, checkpoint: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its bytes are in the manifest; where there is no such file, it is refused at its line."""
    mine = tmp_path / "mine.yaml"
    mine.write_text(MINE.format(network=checkpoint.name))
    found = digests(load_scenario(mine))
    own = {checkpoint.name: digest(checkpoint)}
    assert found["encoder"] == found["policy"] == own
    mine.write_text(MINE.format(network="nets/yours.safetensors"))
    assert main(["check", str(mine)]) == 2
    said = capsys.readouterr().out
    for place in (f"{mine}:5:35: components.encoder", f"{mine}:6:34: components.policy"):
        assert f"{place}.parameters.network: there is no file {tmp_path}/nets/yours" in said


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
