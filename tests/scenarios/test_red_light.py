"""The main job: the red-light study in a closed loop, as users run it."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

import scenarios
from orchestrator.cli import main
from orchestrator.recording import Recording
from studies.red_light.sharing_cost import sharing_cost

SCENARIO = Path(scenarios.__file__).with_name("red_light.yaml")
SEEDS = (1, 2, 3)
Json = dict[str, Any]


def nlosim(*arguments: str | Path, capsys: pytest.CaptureFixture[str]) -> Json:
    """Run a command that must succeed; what it prints with `--json`."""
    capsys.readouterr()
    code = main([*map(str, arguments), "--json", "--quiet"])
    captured = capsys.readouterr()
    assert code == 0, captured.out + captured.err
    result: Json = json.loads(captured.out)
    return result


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_cooperative_perception_prevents_the_collision_that_the_blind_ego_has(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same seed, with and without V2X: only the policy differs."""
    common = ("run", SCENARIO, "--seed", str(seed))
    blind = nlosim(
        *common,
        "--set",
        "components.policy.type=policy-blind",
        "--out",
        tmp_path / "blind",
        capsys=capsys,
    )
    assert blind["metrics"]["collision"]
    seeing = nlosim(*common, "--out", tmp_path / "seeing", capsys=capsys)
    metrics = seeing["metrics"]
    assert not metrics["collision"]
    assert metrics["min_gap_m"] > 1.0
    assert metrics["braking"]["object"] == metrics["hidden_vehicle"]["id"]
    assert metrics["hidden_vehicle"]["first_seen_by"] == "sharing node"
    assert metrics["hidden_vehicle"]["received_by_ego"] < metrics["braking"]["time"]
    assert metrics["braking"]["time"] < metrics["hidden_vehicle"]["seen_by_ego"]
    assert metrics["prr"]["end_to_end"] > metrics["prr"]["direct"]
    files = [path for path in (tmp_path / "seeing" / "signals").rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 15_000_000
    assert (tmp_path / "seeing" / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_what_the_ego_demands_is_enough(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The hidden vehicle lies in a blind zone when it matters; the rest need not be sent."""
    answer = "components.facilities.parameters.answer"
    costs = {}
    for choice in ("all", "demanded"):
        out = tmp_path / choice
        run = nlosim(
            "run", SCENARIO, "--seed", str(seed), "--set", f"{answer}={choice}", "--no-figure",
            "--out", out, capsys=capsys,
        )  # fmt: skip
        metrics = run["metrics"]
        assert not metrics["collision"]
        assert metrics["min_gap_m"] > 1.0
        assert metrics["braking"]["object"] == metrics["hidden_vehicle"]["id"]
        assert metrics["braking"]["time"] < metrics["hidden_vehicle"]["seen_by_ego"]
        costs[choice] = sharing_cost(Recording(out))
    assert costs["demanded"].data_bytes < costs["all"].data_bytes / 2


def test_the_blocking_vehicles_obstruct_the_direct_link_when_the_ego_approaches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Free far away, obstructed on the approach: what makes the relay necessary."""
    direct = nlosim(
        "run",
        SCENARIO,
        "--set",
        "components.relay.type=relay-direct",
        "--set",
        "time.stop=14 s",
        "--out",
        tmp_path / "direct",
        capsys=capsys,
    )
    (link,) = direct["metrics"]["links"]
    assert link["prr"] == direct["metrics"]["prr"]["end_to_end"] < 0.6
    assert link["classes"]["NLOSv"] > link["classes"]["LOS"]


@pytest.mark.slow
def test_the_fingerprint_does_not_depend_on_where_components_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One process, the loopback, and five processes over either transport."""
    prints = {
        transport: nlosim(
            "run",
            SCENARIO,
            "--set",
            "time.stop=9 s",
            "--transport",
            transport,
            "--out",
            tmp_path / transport,
            capsys=capsys,
        )["fingerprint"]
        for transport in ("in-process", "loopback", "local", "zenoh")
    }
    assert len(set(prints.values())) == 1, prints
    manifest = json.loads((tmp_path / "zenoh" / "manifest.json").read_text())
    remote = [c for c in manifest["scenario"]["components"].values() if c.get("process")]
    assert len(remote) == 5


def test_two_runs_are_equal_and_another_seed_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prints = [
        nlosim(
            "run",
            SCENARIO,
            "--seed",
            str(seed),
            "--set",
            "time.stop=1 s",
            "--out",
            tmp_path / str(k),
            capsys=capsys,
        )["fingerprint"]
        for k, seed in enumerate((1, 1, 2))
    ]
    assert prints[0] == prints[1] != prints[2]


def test_the_scenario_in_the_manifest_repeats_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Overrides applied, defaults written out, seeds still drawn from the scenario's seed."""
    out = tmp_path / "first"
    overrides = ("--seed", "7", "--set", "time.stop=2 s")
    first = nlosim("run", SCENARIO, *overrides, "--out", out, capsys=capsys)
    resolved = json.loads((out / "manifest.json").read_text())["scenario"]
    again = tmp_path / "again.yaml"
    again.write_text(yaml.safe_dump(resolved, sort_keys=False))  # entities are in an order
    second = nlosim("run", again, "--out", tmp_path / "second", capsys=capsys)
    assert second["fingerprint"] == first["fingerprint"]


def started(out: Path, *arguments: str) -> subprocess.Popen[str]:
    """A long run in a process of its own, once it has recorded something."""
    command = [sys.executable, "-m", "orchestrator", "run", str(SCENARIO), "--out", str(out)]
    process = subprocess.Popen(
        [*command, "--quiet", "--set", "time.stop=1000 s", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    index = out / "signals" / "index.json"
    deadline = time.monotonic() + 60
    while not (index.exists() and len(Recording(out)["channel.receptions"]) > 10):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def hosts_of(parent: int) -> dict[str, int]:
    """The component processes of a run, which is a child of `parent`: command to process id."""
    (run,) = children_of(parent).values()
    return children_of(run)


def children_of(parent: int) -> dict[str, int]:
    """The processes that one has started: command to process id."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            status = (entry / "status").read_text()
            words = (entry / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        if re.search(rf"^PPid:\s+{parent}$", status, re.MULTILINE):
            found[" ".join(words)] = int(entry.name)
    return found


def readable_until(out: Path) -> int:
    """The last communication point of the recording; every signal must be readable."""
    recording = Recording(out)
    for name in recording.signals:
        series = recording[name]
        assert len(series) == len(series.times)
        series[len(series) - 1]
    return int(recording["channel.receptions"].times[-1])


@pytest.fixture
def run_directory(tmp_path: Path) -> Path:
    return tmp_path / "run"


@pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")
@pytest.mark.parametrize("transport", ["local", "zenoh"])
def test_a_killed_component_ends_the_run_by_name_and_time(
    run_directory: Path, transport: str
) -> None:
    process = started(run_directory, "--transport", transport)
    hosts = hosts_of(process.pid)
    assert len(hosts) == 5
    (victim,) = (pid for words, pid in hosts.items() if "perception" in words)
    os.kill(victim, signal.SIGKILL)
    killed = time.monotonic()
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 3
    assert time.monotonic() - killed < 5  # measured: half a second; CI machines are noisy
    message = re.search(r"component `perception` at t = ([0-9.]+) s: .*SIGKILL", errors)
    assert message is not None, errors
    assert "Traceback" not in errors
    until = readable_until(run_directory)
    assert 0 < until < float(message[1]) * 1e9 + 100e6  # perception steps every 100 ms
    manifest = json.loads((run_directory / "manifest.json").read_text())
    assert manifest["status"] == "failed"
    assert all(not Path(f"/proc/{pid}").exists() for pid in hosts.values())


def test_an_interrupted_run_keeps_what_it_recorded(run_directory: Path) -> None:
    process = started(run_directory)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 4
    assert str(run_directory) in errors
    assert "Traceback" not in errors
    assert readable_until(run_directory) > 0
    manifest = json.loads((run_directory / "manifest.json").read_text())
    assert manifest["status"] == "interrupted"
