"""The component: its contract, changing scenes, wrong input and missing devices."""

import dataclasses
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from adapters.fmi.errors import FmuError
from fmus.lidar.gpu import LidarTorch, scanner
from orchestrator.cli import main
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Signals
from orchestrator.testing import check_component
from orchestrator.timebase import Time
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import NO_NOISE, create, inputs, points_of, scan, town

A = Vehicle(id=3, lidar=True)
B = Vehicle(id=5, position=(10.0, 0.0, 0.0))
HOUSE = Building(ring=rectangle(20.0, 0.0, 5.0, 5.0))
GOOD = Scene(vehicles=[A, B], buildings=[HOUSE, HOUSE])
INDEX = [0, 0, 0, 0, 1, 1, 1, 1]
EMPTY_FRAME = b"LPTS" + bytes([1, 0, 0, 0, 0, 0, 0, 0, 72, 0, 0, 0])


def driven(t: Time) -> Signals:
    """A car that drives along, joined by a bus with a sensor after 0.2 s."""
    car = dataclasses.replace(B, position=(10.0 + 20e-9 * t, 2.0, 0.0))
    bus = Vehicle(id=9, position=(-15.0, 4.0, 0.0), size=(12.0, 2.5, 3.0), body=3, lidar=True)
    joined = [bus] if t >= 200_000_000 else []
    return inputs(Scene(vehicles=[A, car, *joined], buildings=[HOUSE]))


def test_the_contract_is_kept(device: str) -> None:
    small = {"azimuths": 60, "channels": 16, "device": device}
    check_component(create("lidar-torch", **small), steps=4, inputs=driven)
    check_component(create("lidar-torch", **small, seed=3, pitch=0.1), steps=2)


def test_it_computes_with_one_thread(device: str) -> None:
    torch.set_num_threads(2)
    scan("lidar-torch", GOOD, device=device)
    assert torch.get_num_threads() == 1


def test_nobody_and_nothing_is_an_empty_frame(device: str) -> None:
    for scene in (Scene(), Scene(vehicles=[B]), Scene(buildings=[HOUSE])):
        assert scan("lidar-torch", scene, device=device) == EMPTY_FRAME


def test_a_sensor_alone_sees_the_ground(device: str) -> None:
    """64 channels from +4 to -20 degrees: those that meet the ground within 50 m, all around."""
    points = points_of(scan("lidar-torch", Scene(vehicles=[A]), device=device, **NO_NOISE))
    assert set(points["instance"].tolist()) == {-1}
    np.testing.assert_allclose(points["position"][:, 2], -2.0, atol=1e-6)
    lowest = -2.0 / 50.0
    elevation = np.radians(4) - np.radians(24) * np.arange(64) / 63
    assert len(points) == 1024 * (np.sin(elevation) < lowest).sum()


def test_vehicles_come_and_go(device: str) -> None:
    lidar = create("lidar-torch", device=device, **NO_NOISE)
    lidar.setup(0, np.random.default_rng(0))
    lidar.initialise(inputs(GOOD))
    seen = [set(points_of(bytes(lidar.outputs()["points"]))["instance"].tolist())]
    for step, scene in enumerate([Scene(vehicles=[A]), Scene(), GOOD]):
        lidar.step(inputs(scene), step * 10**8, 10**8)
        seen.append(set(points_of(bytes(lidar.outputs()["points"]))["instance"].tolist()))
    assert seen == [{-1, -2, 5}, {-1}, set(), {-1, -2, 5}]
    lidar.close()


def test_batches_change_nothing(device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = town(3, vehicles=40, buildings=8, sensors=7, heights=[2.0, 9.0])
    whole = scan("lidar-torch", scene, device=device, azimuths=180)
    assert scan("lidar-torch", scene, device=device, azimuths=180) == whole
    for name, size in (("_BATCH_RAYS", 3 * 180 * 64), ("_BATCH_RAYS", 1), ("_BATCH_PAIRS", 200)):
        monkeypatch.setattr(scanner, name, size)
        assert scan("lidar-torch", scene, device=device, azimuths=180) == whole


def test_more_points_than_the_format_holds_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scanner, "_POINT_LIMIT", 1000)
    with pytest.raises(ValueError, match=r"the sensors see \d+ points, more than 999; let fewer"):
        scan("lidar-torch", GOOD)


WRONG = [
    ("vehicle.position", [[0, 0, 0], [1, math.nan, 0]]),
    ("vehicle.position", [[math.inf, 0, 0], [1, 1, 0]]),
    ("vehicle.position", [[0, 0, 1e300], [1, 1, 0]]),
    ("vehicle.heading", [0, math.nan]),
    ("vehicle.heading", [1e9, 0]),
    ("vehicle.size", [[4, 2, 1], [4, -2, 1]]),
    ("vehicle.size", [[4, 2, 0], [4, 2, 1]]),
    ("vehicle.size", [[4, 2, 1], [math.nan, 2, 1]]),
    ("vehicle.body", [0, 9]),
    ("vehicle.body", [-1, 0]),
    ("vehicle.id", [5, 3]),
    ("vehicle.id", [5, 5]),
    ("vehicle.id", [-1, 5]),
    ("vehicle.id", [0, 2**31]),
    ("building.vertex", [[0, 0]] * 7 + [[math.inf, 0]]),
    ("building.index", [0, 0, 0, 0, 1, 1, 1, 2]),
    ("building.index", [-1, *INDEX[1:]]),
    ("building.index", [0, 0, 0, 1, 0, 1, 1, 1]),
    ("building.index", [0] * 6 + [1] * 2),
    ("building.index", [1] * 8),
    ("building.height", [3, -1]),
    ("building.height", [math.nan, 3]),
]


def refusal(kind: str, wrong: Signals) -> str:
    """What a lidar of this kind says about inputs at its second scan."""
    lidar = create(kind)
    lidar.setup(0, np.random.default_rng(0))
    lidar.initialise(inputs(GOOD))
    try:
        with pytest.raises((ValueError, FmuError)) as caught:
            lidar.step(wrong, 0, 10**8)
        return str(caught.value).replace("-nan", "nan")
    finally:
        lidar.close()


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_what_the_fmu_refuses_is_refused_in_the_same_words(name: str, value: Any) -> None:
    good = inputs(GOOD)
    wrong = {**good, name: np.array(value, np.asarray(good[name]).dtype)}
    said = refusal("lidar-torch", wrong)
    assert said.startswith((name, "building ")), "the first culprit, by name"
    assert said in refusal("lidar", wrong)


def test_of_several_culprits_the_first_is_named() -> None:
    wrong = {
        **inputs(GOOD),
        "vehicle.heading": np.array([0.0, math.nan]),
        "vehicle.body": np.array([9, 0], np.int32),
        "building.height": np.array([-1.0, -1.0]),
    }
    assert refusal("lidar-torch", wrong).startswith("vehicle.body[0] is 9")
    assert refusal("lidar-torch", wrong) in refusal("lidar", wrong)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"channels": 0}, "`channels` is 0; it must be 1 ... 512"),
        ({"azimuths": 8193}, "`azimuths` is 8193; it must be 4 ... 8192"),
        ({"range": math.nan}, "`range` is nan; it must be 0.1 ... 1000"),
        ({"elevation_top": 1.6}, "`elevation_top` is 1.6; it must be -1.5 ... 1.5"),
        ({"dropout": 1.1}, "`dropout` is 1.1; it must be 0 ... 1"),
        ({"roll": 4.0}, "`roll` is 4; it must be -3.14159 ... 3.14159"),
        ({"seed": 2**63}, "`seed` is 9223372036854775808; it must be an integer of 64 bits"),
        ({"device": "tpu"}, "`device` is 'tpu'; it must be cpu or cuda"),
        (
            {"elevation_top": -0.4},
            "`elevation_bottom` is -0.349066 rad; it must be less than `elevation_top`, -0.4 rad",
        ),
        ({"range": 0.0, "dropout": -1.0}, "`range` is 0; .*\n`dropout` is -1"),
    ],
)
def test_wrong_parameters_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentTypeError, match=message.replace("...", r"\.\.\.")):
        create("lidar-torch", **given)


def test_one_channel_has_no_bottom() -> None:
    one = {"channels": 1, "elevation_top": -0.4, "azimuths": 4, **NO_NOISE}
    points = points_of(scan("lidar-torch", Scene(vehicles=[A]), **one))
    np.testing.assert_allclose(points["position"][0], [2.0 / math.tan(0.4), 0.0, -2.0], atol=1e-5)


def test_step_without_setup_says_so() -> None:
    with pytest.raises(RuntimeError, match="the lidar is not running: `setup` comes first"):
        LidarTorch(LidarTorch.Parameters()).step(inputs(GOOD), 0, 10**8)


@pytest.mark.parametrize(
    ("version", "message"),
    [(None, "is built without CUDA"), ("13.0", "finds no usable GPU, though it is built for CUDA")],
)
def test_a_gpu_that_is_not_there_is_wrong_input(
    version: str | None, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.version, "cuda", version)
    with pytest.raises(ComponentTypeError, match=message) as caught:
        create("lidar-torch", device="cuda")
    assert str(caught.value).startswith("`device` is cuda, but the installed PyTorch ")
    assert str(caught.value).endswith("; write `device: cpu`")


SCENARIO = """\
schema: 1
title: A lidar alone
time: {start: 0 s, stop: 1 s}
components:
  lidar:
    type: lidar-torch
    step: 100 ms
    parameters: {device: cuda}
"""


@pytest.mark.parametrize("command", ["check", "run"])
def test_the_command_line_points_at_the_device(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.chdir(tmp_path)
    Path("alone.yaml").write_text(SCENARIO)
    assert main([command, "alone.yaml"]) == 2
    printed = "".join(capsys.readouterr())
    assert re.search(r"alone.yaml:8:\d+: components.lidar: `device` is cuda, but", printed)


def python(code: str, folder: Path) -> str:
    """What a new interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=folder, check=True
    )
    return done.stdout + done.stderr


def test_listing_components_does_not_import_torch(tmp_path: Path) -> None:
    code = """
import sys
from orchestrator.cli import main
assert main(["components"]) == main(["components", "lidar-torch"]) == 0
assert "torch" not in sys.modules
"""
    assert "choose" not in python(code, tmp_path)


def test_without_torch_it_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "alone.yaml").write_text(SCENARIO.replace("cuda", "cpu"))
    code = """
import sys
sys.modules["torch"] = None  # as if it were not installed
from orchestrator.cli import main
assert main(["components", "lidar-torch"]) == 0
assert main(["check", "alone.yaml"]) == 2
"""
    printed = python(code, tmp_path)
    assert printed.count("PyTorch is not installed; run `pip install 'nlosim[torch]'`") == 2
