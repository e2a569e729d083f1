"""Foxglove's own packages of npm, which Lichtblick uses too, read the file and the WebSocket.

They are not on the Python path: `npm install --ignore-scripts` in a folder with the `package.json`
beside this file, and `NLOSIM_NODE_MODULES` names that folder.
"""

import json
import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from studies.exports.viewing import Viewing

pytest.importorskip("foxglove")

SCRIPT: Final = Path(__file__).with_name("foxglove_packages.cjs")
NODE: Final = shutil.which("node")
MODULES: Final = os.environ.get("NLOSIM_NODE_MODULES")

pytestmark = [
    pytest.mark.skipif(NODE is None, reason="no node on the path"),
    pytest.mark.skipif(MODULES is None, reason="NLOSIM_NODE_MODULES names no folder"),
]


def read(*words: str) -> tuple[dict[str, Any], dict[str, list[tuple[int, Any]]], list[str]]:
    """The channels by topic; times [ns] and messages by topic; what was not understood."""
    done = subprocess.run(
        [str(NODE), str(SCRIPT), str(MODULES), *words],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr[:2000]
    channels: dict[str, Any] = {}
    found: dict[str, list[tuple[int, Any]]] = {}
    later: list[str] = []
    for line in done.stdout.splitlines():
        said = json.loads(line)
        if isinstance(said, list):
            channels.update({each["topic"]: each for each in said})
        elif "later" in said:
            later = said["later"]
        else:
            found.setdefault(said["topic"], []).append((said["time"], said["content"]))
    return channels, found, later


def boxes_are_right(found: list[tuple[int, Any]], recording: Recording) -> int:
    """How many boxes there are; each is where the road user of its number was."""
    count = 0
    for time, update in found:
        told = {
            name: np.asarray(recording[f"road.vehicle.{name}"].at(time))
            for name in ("id", "position", "size")
        }
        assert [int(each["id"]) for each in update["entities"]] == told["id"].tolist()
        for entity, place, size in zip(
            update["entities"], told["position"], told["size"], strict=True
        ):
            (cube,) = entity["cubes"]
            at = cube["pose"]["position"]
            assert (at["x"], at["y"], at["z"]) == (place[0], place[1], size[2] / 2)
            assert tuple(cube["size"].values()) == tuple(size)
            count += 1
    return count


@pytest.fixture(scope="module")
def exported(street: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("npm") / "street.mcap"
    assert main(["export", str(street), "--mcap", "--out", str(path)]) == 0
    return path


def test_the_file_is_read_and_every_box_is_where_it_was(exported: Path, street: Path) -> None:
    channels, found, _ = read("mcap", str(exported))
    recording = Recording(street)
    times = recording["road.vehicle.id"].times.tolist()
    assert [time for time, _ in found["/scene"]] == times
    everybody = int(recording["road.vehicle.id"].lengths.sum())
    assert boxes_are_right(found["/scene"], recording) == everybody
    points = [each for topic, each in found.items() if topic.startswith("/points/")]
    assert len(points) == 3
    schemas = {topic: each["schema"] for topic, each in channels.items()}
    assert {schemas[topic] for topic in ("/scene", "/surroundings")} == {"foxglove.SceneUpdate"}
    assert schemas["/tf"] == "foxglove.FrameTransforms"
    assert schemas["/log"] == "foxglove.Log"
    assert schemas["/points/scanner.points/0"] == "foxglove.PointCloud"
    assert schemas["/signals/messages"] == "messages"


def test_schemas_have_the_fields_that_foxglove_publishes(exported: Path) -> None:
    channels, _, _ = read("mcap", str(exported))
    ours = {each["schema"]: each for each in channels.values() if each["published"] is not None}
    assert len(ours) == 4
    for each in ours.values():
        assert set(each["published"]) <= set(each["fields"])


def test_numbers_are_where_a_message_path_finds_them(exported: Path, street: Path) -> None:
    """`/signals/messages.received.sensor_data.count`: a dot is a step inwards."""
    _, found, _ = read("mcap", str(exported))
    counts = Recording(street)["messages.received.sensor_data.count"]
    told = [
        content["received"]["sensor_data"]["count"] for _, content in found["/signals/messages"]
    ]
    assert told == np.asarray(counts.values).tolist()


@pytest.fixture
def served(street: Path) -> Iterator[Viewing]:
    ended = threading.Event()
    viewing = Viewing(street, speed=10.0)
    viewing.start("127.0.0.1", 0)
    thread = threading.Thread(target=viewing.serve, args=(ended,))
    thread.start()
    yield viewing
    ended.set()
    thread.join()
    viewing.stop()


def test_the_websocket_tells_the_same(served: Viewing, street: Path) -> None:
    recording = Recording(street)
    times = recording["road.vehicle.id"].times.tolist()
    url = f"ws://127.0.0.1:{served.port}"
    words = (f"/scene={len(times)}", "/tf=1", "/signals/messages=1")
    channels, found, later = read("listen", url, *words)
    assert channels["/scene"]["schema"] == "foxglove.SceneUpdate"
    assert [time for time, _ in found["/scene"] if time > 0] == times[1:]
    assert boxes_are_right(found["/scene"], recording) > 4 * 10 + 3 * 10
    assert "received" in found["/signals/messages"][0][1]
    # the state of the player is younger than the package
    assert set(later) <= {"Unrecognized server opcode in binary message: 5"}
