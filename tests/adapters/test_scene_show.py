"""`nlosim scene show`: a picture of a scene, or of what is around an entity."""

from pathlib import Path

import numpy as np
import pytest

from adapters.traffic.drawing import View, draw
from orchestrator.cli import main


def test_a_view_is_a_square_around_its_center_as_far_as_there_is_something() -> None:
    signals = {
        "road.vertex": np.array([[-100.0, -2.0], [100.0, -2.0], [100.0, 2.0], [-100.0, 2.0]]),
        "road.index": np.zeros(4, np.int32),
        "building.vertex": np.zeros((0, 2)),
        "building.index": np.zeros(0, np.int32),
        "vehicle.id": np.array([7]),
        "vehicle.position": np.array([[40.0, 0.0, 0.75]]),
        "vehicle.heading": np.zeros(1),
        "vehicle.size": np.array([[5.0, 2.0, 1.5]]),
        "vehicle.body": np.zeros(1, np.int32),
        "vehicle.lidar": np.zeros(1, np.bool_),
    }
    view = View(center=np.array([40.0, 0.0]), radius=30.0)
    (axes,) = draw(signals, {7: "ego"}, "", view).axes
    margin = 0.03 * 60.0
    assert axes.get_xlim() == pytest.approx((10.0 - margin, 70.0 + margin))
    (whole,) = draw(signals, {7: "ego"}, "").axes
    assert whole.get_xlim() == pytest.approx((-106.0, 106.0))


def test_a_picture_around_somebody_who_is_not_there_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "scene.png"
    assert main(["scene", "show", "platoon", "--around", "bus", "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert "no entity `bus` is there at 0 s; those that are: blocking, collider, ego" in error
    assert not out.exists()
    assert main(["scene", "show", "platoon", "--around", "ego", "--out", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")
