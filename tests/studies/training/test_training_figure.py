"""The figure of a training, drawn from the tables alone; and where to learn."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from studies.training import device, figure
from studies.training.results import Findings

EPOCHS: list[dict[str, Any]] = [
    {
        "round": number,
        "epoch": epoch,
        "training_loss": 1 / (number + epoch),
        "validation_loss": 2 / (number + epoch),
        "seconds": 1.0,
        "kept": epoch == 3,
    }
    for number in range(3)
    for epoch in (1, 2, 3, 4)
]
PHASES: list[dict[str, Any]] = [
    {
        "phase": name,
        "driver": "expert",
        "beta": beta,
        "collision": 0.5,
        "collision_low": 0.4,
        "collision_high": 0.6,
        "success": success,
        "success_low": success,
        "success_high": success,
    }
    for name, beta, success in (("expert", 1.0, 0.5), ("dagger-1", 0.5, None))
]


@pytest.mark.parametrize(
    ("epochs", "phases"), [(EPOCHS, PHASES), ([], PHASES), (EPOCHS[:1], []), ([], [])]
)
def test_a_figure_at_any_time_with_equal_bytes(
    tmp_path: Path, epochs: list[dict[str, Any]], phases: list[dict[str, Any]]
) -> None:
    """Also of a training that was interrupted before anything came out."""
    found = Findings(epochs=epochs, phases=phases, chosen=None)
    written = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        figure.draw(found, tmp_path / name)
        written.append([(tmp_path / name / f"training.{s}").read_bytes() for s in ("svg", "png")])
    assert written[0] == written[1]


def test_every_round_is_marked(tmp_path: Path) -> None:
    figure.draw(Findings(epochs=EPOCHS, phases=PHASES, chosen=2), tmp_path)
    text = (tmp_path / "training.svg").read_text()
    for number in range(3):
        assert f"<!-- round {number} -->" in text


def torch(*, has_gpu: bool) -> SimpleNamespace:
    return SimpleNamespace(cuda=SimpleNamespace(is_available=lambda: has_gpu))


@pytest.mark.parametrize(
    ("module", "auto"),
    [(None, "cpu"), (torch(has_gpu=False), "cpu"), (torch(has_gpu=True), "cuda")],
)
def test_auto_is_the_gpu_where_there_is_one(
    monkeypatch: pytest.MonkeyPatch, module: object, auto: str
) -> None:
    monkeypatch.setitem(sys.modules, "torch", module)
    assert device.resolve("auto") == auto
    assert device.resolve("cpu") == "cpu"


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (None, r"needs PyTorch: pip install 'nlosim\[train\]'"),
        (torch(has_gpu=False), "finds no GPU for `device: cuda`; write `device: auto`"),
    ],
)
def test_a_gpu_that_is_not_there(
    monkeypatch: pytest.MonkeyPatch, module: object, message: str
) -> None:
    monkeypatch.setitem(sys.modules, "torch", module)
    with pytest.raises(device.DeviceError, match=message):
        device.resolve("cuda")
