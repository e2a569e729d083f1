"""The policy benchmark: what it drives through, what it measures, and what is made of that."""

import itertools
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.benchmark import Measurement
from benchmarks.policy import PolicyBenchmark
from benchmarks.policy.benchmark import CARLA, CARLA_SPEED, LOOP_TARGET, PEER, STEP_TARGET
from benchmarks.policy.loop import RULE_BASED, LoopRun, network_settings
from benchmarks.policy.scans import EARLIER, PERIOD, SCENARIO, STARTS, Moment, record
from benchmarks.policy.step import StepRun
from benchmarks.policy.transformer import TransformerRun, blocks_for, is_torch_installed
from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint
from fmus.driving.network.encoder import BevEncoder
from fmus.driving.network.sensors import Sender
from orchestrator.cli import main
from orchestrator.scenario.build import load_scenario
from orchestrator.timebase import nanoseconds

COARSE = Architecture(keypoints=32, features=256, spacing=6)
FINE = Architecture(keypoints=128, features=128, spacing=2)
needs_torch = pytest.mark.skipif(not is_torch_installed(), reason="PyTorch is not installed")


def checkpoint(architecture: Architecture) -> Checkpoint:
    rng = np.random.default_rng(1)
    weights = {name: rng.normal(0.0, 0.05, n) for name, n in architecture.shapes.items()}
    return Checkpoint(architecture=architecture, weights=weights, origin={})


@cache
def drive() -> tuple[Moment, ...]:
    """Two scans, 1 s after the start, and those before."""
    (moments,) = record({"1s": nanoseconds("1")}, scans=2).values()
    return tuple(moments)


def test_a_drive_is_a_row_of_scans_of_both_vehicles() -> None:
    moments = drive()
    times = [moment.time for moment in moments]
    first = nanoseconds("1") - EARLIER * PERIOD
    assert times == [first + k * PERIOD for k in range(EARLIER + 2)]
    for moment in moments:
        own, other = moment.scans()
        assert own.vehicle == moment.ego != other.vehicle
        assert own.time == other.time == moment.time
        assert min(len(own.x), len(other.x)) > 10_000
    for before, after in itertools.pairwise(moments):
        way = np.asarray(after.inputs["ego.position"]) - np.asarray(before.inputs["ego.position"])
        speed = float(before.inputs["ego.speed"])
        assert np.hypot(*way) == pytest.approx(0.1 * speed, abs=0.1)
        assert speed > 5.0, "the expert drives, and nothing is in its way yet"


def test_drives_begin_where_the_scene_differs() -> None:
    starts = list(STARTS.values())
    assert len(starts) >= 3
    assert all(b - a >= nanoseconds("1") for a, b in itertools.pairwise(starts))
    assert all(start % PERIOD == 0 and start > EARLIER * PERIOD for start in starts)


@pytest.mark.parametrize("architecture", [COARSE, FINE], ids=["32", "128"])
def test_a_step_is_measured(architecture: Architecture, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each scan is encoded once: by the sharer, by the ego, and not again half a period later."""
    encoded = []
    encode = BevEncoder.encode

    def counted(self: BevEncoder, *arguments: Any) -> Any:
        encoded.append(self)
        return encode(self, *arguments)

    monkeypatch.setattr(BevEncoder, "encode", counted)
    found = StepRun(moments=drive(), checkpoint=checkpoint(architecture)).measure()
    assert len(encoded) == 2 * len(drive())
    assert [encoded.count(one) for one in set(encoded)] == [len(drive())] * 2
    assert found["step_ms"] == pytest.approx(found["sharer_ms"] + found["ego_ms"])
    assert min(found["sharer_ms"], found["ego_ms"], found["fusion_ms"]) > 0
    own, other = drive()[-1].scans()
    assert found["points"] == pytest.approx(len(own.x) + len(other.x), rel=0.05)


@needs_torch
@pytest.mark.parametrize("architecture", [COARSE, FINE], ids=["32", "128"])
def test_the_peer_sends_messages_of_the_same_size(architecture: Architecture) -> None:
    from fmus.driving.point_transformer import PointTransformerEncoder  # noqa: PLC0415 - needs PyTorch

    peer = PointTransformerEncoder(blocks=blocks_for(architecture.keypoints))
    _, cloud = drive()[0].scans()
    assert peer.message_size() == Sender(checkpoint(architecture)).message(cloud).size


@needs_torch
def test_the_peer_is_measured_on_one_thread_and_leaves_their_number_alone() -> None:
    import torch  # noqa: PLC0415 - optional

    threads = torch.get_num_threads()
    found = TransformerRun(moments=drive(), blocks=3).measure()
    assert found["step_ms"] == pytest.approx(found["sharer_ms"] + found["ego_ms"])
    assert min(found["sharer_ms"], found["ego_ms"]) > 0
    assert torch.get_num_threads() == threads


@pytest.mark.parametrize("architecture", [COARSE, FINE], ids=["32", "128"])
def test_the_loop_is_measured(architecture: Architecture, tmp_path: Path) -> None:
    path = tmp_path / "random.safetensors"
    checkpoint(architecture).write(path)
    settings = network_settings(str(path), architecture)
    found = LoopRun(settings=[*settings, "time.stop=500 ms"]).measure()
    assert found["simulated_s"] == 0.5
    assert 0 < found["speed"] < 1000
    assert min(found["policy_s"], found["encoder_s"]) > 0
    assert found["policy_s"] + found["encoder_s"] < found["wall_s"]
    assert found["simulated_s"] / found["wall_s"] < found["speed"], "loading takes time, too"


def test_the_rules_need_no_encoder() -> None:
    found = LoopRun(settings=[*RULE_BASED, "time.stop=300 ms"]).measure()
    assert found["simulated_s"] == 0.3


@pytest.mark.parametrize(("architecture", "compression"), [(COARSE, 32), (FINE, 16)])
def test_the_scenario_is_told_the_size_of_messages(
    architecture: Architecture, compression: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "random.safetensors"
    checkpoint(architecture).write(path)
    monkeypatch.chdir(tmp_path)
    for given in (str(path), "random.safetensors"):
        components = load_scenario(SCENARIO, network_settings(given, architecture)).components
        assert components["facilities"].values["compression"] == compression
        assert components["encoder"].values["network"] == path
        assert components["policy"].values["network"] == path
    odd = Architecture(keypoints=7, features=40)
    assert not [text for text in network_settings("odd", odd) if "compression" in text]


def measured() -> dict[str, list[Measurement]]:
    """Three repetitions of everything, the peer ten times as slow."""
    keys = ("step_ms", "sharer_ms", "ego_ms", "fusion_ms", "points")
    loop = ("speed", "simulated_s", "wall_s", "cpu_s", "policy_s", "encoder_s")
    found: dict[str, list[Measurement]] = {}
    for name in STARTS:
        found[f"step/{name}"] = [dict.fromkeys(keys, n) for n in (1.0, 2.0, 9.0)]
        found[f"step/{name}/point-transformer"] = [
            dict.fromkeys(keys[:3], n) for n in (8.0, 20.0, 60.0)
        ]
    for name in ("network", "rule-based"):
        found[f"loop/{name}"] = [dict.fromkeys(loop, n) for n in (1.0, 2.0, 9.0)]
    return found


def test_rows_compare_the_steps_with_the_peer_and_the_loop_with_carla() -> None:
    rows = {row.case: row for row in PolicyBenchmark().rows(measured())}
    assert len(rows) == 4 * len(STARTS) + 2
    for name, row in rows.items():
        assert (row.ours, row.low, row.high) == (2.0, 1.0, 9.0)
        if name.startswith("loop/"):
            assert (row.peer, row.peer_name) == (CARLA_SPEED, CARLA)
            assert row.ratio == pytest.approx(2.0 / CARLA_SPEED)
            assert row.details["target"] == LOOP_TARGET
        elif name.endswith("/fusion"):
            assert row.ratio is None, "the peer has no fusion"
        else:
            assert (row.ratio, row.peer_name) == (10.0, PEER)
            assert row.details.get("target_ms") == (STEP_TARGET if name.count("/") == 1 else None)
    alone = {name: runs for name, runs in measured().items() if "transformer" not in name}
    steps = [row for row in PolicyBenchmark().rows(alone) if row.case.startswith("step/")]
    assert len(steps) == 4 * len(STARTS)
    assert all(row.ratio is None for row in steps)


def test_a_network_that_is_not_there_is_noticed_at_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["bench", "policy", "--set", "network=bev-23"]) == 2
    assert "there is no network `bev-23`" in capsys.readouterr().err
