"""Every relay policy in the red-light scenario: by the same seed the same run."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from fmus.records import NO_VEHICLE
from orchestrator.cli import main
from orchestrator.recording import Recording, Series

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")


def run(relay: str, out: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    capsys.readouterr()
    policy, stop = f"components.relay.type={relay}", "time.stop=10 s"
    command = ["run", str(SCENARIO), "--set", policy, "--set", stop, "--out", str(out)]
    code = main([*command, "--no-figure", "--json", "--quiet"])
    captured = capsys.readouterr()
    assert code == 0, captured.out + captured.err
    return json.loads(captured.out)


@pytest.mark.slow
@pytest.mark.parametrize("relay", ["relay-mohed", "relay-random", "relay-signal-strength"])
def test_the_same_seed_gives_the_same_relays(
    relay: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (run(relay, tmp_path / name, capsys) for name in ("first", "second"))
    assert first["fingerprint"] == second["fingerprint"]


@pytest.mark.slow
def test_signal_strength_takes_neighbours_whose_hops_the_ego_was_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("relay-signal-strength", tmp_path / "run", capsys)
    recording = Recording(tmp_path / "run")
    relays = _vehicles(recording["relay.relay"]) - {NO_VEHICLE}
    assert relays
    assert relays <= _vehicles(recording["facilities.received.link.receiver"])
    assert relays <= _vehicles(recording["facilities.received.link.transmitter"])


def _vehicles(series: Series) -> set[int]:
    """All that the signal ever named."""
    return {int(v) for k in range(len(series)) for v in np.atleast_1d(np.asarray(series[k]))}
