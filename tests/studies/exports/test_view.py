"""`nlosim view`: a viewer gets what was recorded, at its time, and nobody else can listen."""

import asyncio
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.layout import read_json, write_manifest
from orchestrator.recording.reader import Recording
from studies.exports.player import Player
from studies.exports.viewing import Viewing

pytest.importorskip("foxglove")
websocket = pytest.importorskip("tornado.websocket")

SECOND = 1_000_000_000


def test_the_player_goes_as_fast_as_it_is_told() -> None:
    player = Player(2 * SECOND, 12 * SECOND, speed=2.0)
    assert player.advance(50.0) == (2 * SECOND, 2 * SECOND)
    player.play(100.0)
    assert player.advance(101.5) == (2 * SECOND, 5 * SECOND)
    player.speed = 0.5
    assert player.advance(102.5) == (5 * SECOND, 5 * SECOND + SECOND // 2)
    player.pause()
    assert player.advance(200.0) == (5 * SECOND + SECOND // 2,) * 2
    player.seek(11 * SECOND, 201.0)
    player.play(201.0)
    assert player.advance(300.0) == (11 * SECOND, 12 * SECOND)
    assert not player.is_playing
    assert player.has_ended
    player.play(301.0)
    assert player.time == 2 * SECOND
    player.seek(99 * SECOND, 302.0)
    assert player.time == 12 * SECOND
    player.seek(0, 302.0)
    assert player.time == 2 * SECOND


async def _listen(
    port: int, topics: set[str], count: int
) -> tuple[dict[str, Any], dict[str, list[int]]]:
    """What a viewer hears: the first message of the server, and times [ns] by topic."""
    connection = await websocket.websocket_connect(
        f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]
    )
    server: dict[str, Any] = {}
    names: dict[int, str] = {}
    heard: dict[str, list[int]] = {topic: [] for topic in topics}
    while sum(map(len, heard.values())) < count:
        message = await asyncio.wait_for(connection.read_message(), 20)
        if isinstance(message, str):
            told = json.loads(message)
            if told["op"] == "serverInfo":
                server = told
            if told["op"] == "advertise":
                wanted = [each for each in told["channels"] if each["topic"] in topics]
                asked = [{"id": each["id"], "channelId": each["id"]} for each in wanted]
                names.update({each["id"]: each["topic"] for each in wanted})
                if asked:
                    request = {"op": "subscribe", "subscriptions": asked}
                    await connection.write_message(json.dumps(request))
        elif message[0] == 1:  # message data: subscription, log time, content
            subscription, time = struct.unpack_from("<IQ", message, 1)
            heard[names[subscription]].append(time)
    connection.close()
    while await connection.read_message() is not None:
        pass  # until the server has closed it, too
    return server, heard


def listened(
    port: int, topics: set[str], count: int
) -> tuple[dict[str, Any], dict[str, list[int]]]:
    return asyncio.run(_listen(port, topics, count))


@pytest.fixture
def serving() -> Iterator[Any]:
    """Starts to serve, in a thread; ends it."""
    ended = threading.Event()
    started: list[tuple[Viewing, threading.Thread]] = []

    def start(viewing: Viewing) -> Viewing:
        viewing.start("127.0.0.1", 0)
        thread = threading.Thread(target=viewing.serve, args=(ended,))
        thread.start()
        started.append((viewing, thread))
        return viewing

    yield start
    ended.set()
    for viewing, thread in started:
        thread.join()
        viewing.stop()


def test_a_viewer_gets_every_sample_of_a_finished_run(street: Path, serving: Any) -> None:
    viewing = serving(Viewing(street, speed=10.0))
    times = Recording(street)["road.vehicle.id"].times.tolist()
    server, heard = listened(viewing.port, {"/scene", "/surroundings"}, 1 + len(times))
    assert set(server["capabilities"]) == {"playbackControl", "time"}
    assert heard["/surroundings"] == [0]
    assert heard["/scene"][0] == 0  # the state when it came
    assert [t for t in heard["/scene"] if t > 0] == times[1:]
    assert viewing.subscriptions == 2


def test_viewers_can_move_the_player(street: Path) -> None:
    viewing = Viewing(street, speed=1.0)
    viewing.start("127.0.0.1", 0)
    listener = viewing._listener

    def ask(command: str, seek: int | None) -> None:
        asked = SimpleNamespace(
            playback_command=getattr(viewing._stage.websocket.PlaybackCommand, command),
            playback_speed=2.0,
            seek_time=seek,
            request_id="r",
        )
        listener.on_playback_control_request(asked)

    ask("Play", SECOND)
    viewing.play(100.0)
    sent = viewing.sent
    viewing.play(100.25)
    assert viewing._player.time == SECOND + SECOND // 2
    recording = Recording(viewing._directory)
    numbers = [n for n in recording.signals if n == "messages.received.sensor_data.count"]
    due = {"road.vehicle.id", "scanner.points", *numbers}
    expected = sum(
        int(((recording[n].times > SECOND) & (recording[n].times <= 1.5 * SECOND)).sum())
        for n in due
    )
    assert viewing.sent - sent == expected
    ask("Pause", None)
    viewing.play(100.5)
    time = viewing._player.time
    viewing.play(200.0)
    assert viewing._player.time == time
    viewing.stop()


def test_a_run_that_goes_on_is_followed_to_its_end(
    street: Path, tmp_path: Path, serving: Any
) -> None:
    """Its end is hidden first, as if it had not been recorded yet."""
    run = tmp_path / "live"
    shutil.copytree(street, run)
    manifest = read_json(run / "manifest.json")
    write_manifest(run, {**manifest, "status": "running"})
    signals = run / "signals"
    signals.rename(run / "later")
    shutil.copytree(run / "later", signals)
    for part in (signals / "road").glob("*.zst"):
        if part.name != "time.zst":
            continue
        part.unlink()
        # as earlier releases wrote it
        np.save(part.with_suffix(".npy"), Recording(street)["road.vehicle.id"].times[:5])
    viewing = serving(Viewing(run, is_live=True))
    assert viewing.is_live

    def go_on() -> None:
        shutil.rmtree(signals)
        (run / "later").rename(signals)
        write_manifest(run, manifest)

    timer = threading.Timer(1.5, go_on)
    timer.start()
    server, heard = listened(viewing.port, {"/scene"}, 1 + 16)
    timer.join()
    assert set(server["capabilities"]) == {"time"}
    times = Recording(run)["road.vehicle.id"].times.tolist()
    assert heard["/scene"] == [times[4], *times[5:]]


def test_it_listens_to_this_machine_only(street: Path) -> None:
    viewing = Viewing(street)
    told = viewing.start("127.0.0.1", 0)
    assert told.startswith(f"ws://127.0.0.1:{viewing.port} plays when a viewer comes")
    assert "without a password" not in told
    with socket.socket() as other:
        other.settimeout(1)
        assert other.connect_ex(("127.0.0.2", viewing.port)) != 0
    again = Viewing(street)
    assert main(["view", str(street), "--port", str(viewing.port)]) == 2
    viewing.stop()
    assert "without a password" in again.start("0.0.0.0", 0)  # noqa: S104 - said so
    again.stop()


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{street}", "--live"], "does not go on; leave --live out"),
        (["{street}", "--speed", "0"], "--speed 0: it must be greater than 0"),
        (["nowhere"], "there is no directory `nowhere`"),
        ([], "there is no run in `runs`; name its directory"),
        (["--live"], "no run goes on in `runs`"),
    ],
)
@pytest.mark.usefixtures("in_an_empty_folder")
def test_what_cannot_be_served_is_said(
    words: list[str], message: str, street: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", *(word.format(street=street) for word in words)]) == 2
    assert message in capsys.readouterr().err


def test_without_the_sdk_it_is_said_what_to_install(
    street: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["view", str(street)]) == 2
    assert "pip install 'nlosim[mcap]'" in capsys.readouterr().err


def test_ctrl_c_ends_it_in_good_order(street: Path) -> None:
    command = [sys.executable, "-m", "orchestrator", "view", str(street), "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stderr is not None
    line = process.stderr.readline()
    assert re.match(r"ws://127\.0\.0\.1:\d+ ", line)
    os.kill(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0
    assert out == "\n0 subscriptions; 0 samples sent\n"
    assert "Traceback" not in err
