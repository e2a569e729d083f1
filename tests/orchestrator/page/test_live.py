"""The page of a run that goes on: newer pages, who may ask for them, and what the browser says."""

import http.client
import json
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import orchestrator.page.live
from orchestrator.cli import main
from orchestrator.page.live import making
from orchestrator.page.live.making import LivePages
from orchestrator.page.live.server import LiveError, served
from orchestrator.recording.layout import read_json, write_manifest
from tests.scripts import Engine, engine

SCRIPT = Path(orchestrator.page.live.__file__).parent / "live.js"


@pytest.fixture
def runs(scenario_file: Path, tmp_path: Path) -> dict[str, Path]:
    """One run of 1 s as it was at 0.5 s, at its end, and when it had said that it ended."""
    found = {}
    for name, stop in (("half", 0.5), ("whole", 1.0)):
        found[name] = tmp_path / name
        options = ["--out", str(found[name]), "--quiet", "--json", "--no-page"]
        assert main(["run", str(scenario_file), *options, "--set", f"time.stop={stop} s"]) == 0
    found["done"] = tmp_path / "done"
    shutil.copytree(found["whole"], found["done"])
    for name in ("half", "whole"):
        write_manifest(
            found[name], {**read_json(found[name] / "manifest.json"), "status": "running"}
        )
    return found


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looks come as often as they are asked for."""
    monkeypatch.setattr(making, "_OFTEN", 0.0)


@pytest.mark.usefixtures("at_once")
def test_there_is_a_newer_page_when_there_is_something_new(runs: dict[str, Path]) -> None:
    pages = LivePages(runs["half"])
    assert (pages.state().version, pages.state().reached) == (0, 0.5)
    assert pages.make()
    assert pages.make()
    assert pages.state().version == 1
    pages.directory = runs["whole"]
    assert (pages.state().version, pages.state().reached) == (1, 1.0)
    assert pages.make()
    assert pages.state().version == 2
    pages.directory = runs["done"]
    assert not pages.make()
    state = pages.state()
    assert (state.version, state.status, state.reached, state.problem) == (3, "done", 1.0, "")
    assert pages.page(1) is None
    newest, before = pages.page(3), pages.page(2)
    assert newest is not None
    assert before is not None
    assert b'"status":"done"' in newest
    assert b'"status":"running"' in before


def test_serving_ends_with_the_run_or_when_asked(runs: dict[str, Path]) -> None:
    ended = threading.Event()
    pages = LivePages(runs["done"])
    pages.serve(ended)
    assert pages.state().version == 1
    ended.set()
    nothing = LivePages(runs["half"])
    nothing.serve(ended)
    assert nothing.state().version == 0


@pytest.mark.usefixtures("at_once")
def test_files_that_cannot_be_read_are_a_problem_after_five_looks(runs: dict[str, Path]) -> None:
    pages = LivePages(runs["whole"])
    assert pages.make()
    index = runs["whole"] / "signals" / "index.json"
    content = index.read_bytes()
    index.write_bytes(content[:-9])
    assert [pages.state().problem for _ in range(4)] == [""] * 4
    assert pages.state().problem.startswith("The run cannot be read: ")
    assert pages.state().reached == 1.0
    index.write_bytes(content)
    assert pages.state().problem == ""


def test_making_pages_takes_a_quarter_of_a_processor(
    runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    spent = iter([10.0, 12.5])
    monkeypatch.setattr(making, "thread_time", lambda: next(spent))
    pages = LivePages(runs["whole"])
    pages.make()
    assert pages.state().wait == 10.0


@pytest.fixture
def address(runs: dict[str, Path]) -> Iterator[str]:
    pages = LivePages(runs["done"])
    pages.make()
    with served(pages, "127.0.0.1", 0) as url:
        yield url.removeprefix("http://").removesuffix("/")


def asked(address: str, path: str, host: str = "", method: str = "GET") -> tuple[int, bytes, Any]:
    """Status, content and headers of an answer."""
    connection = http.client.HTTPConnection(address, timeout=10)
    connection.request(method, path, headers={"Host": host} if host else {})
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content, answer.headers


def test_a_browser_gets_the_page_and_what_follows_it(address: str, runs: dict[str, Path]) -> None:
    status, content, headers = asked(address, "/")
    assert (status, headers["Cache-Control"]) == (200, "no-store")
    assert b"live.js" in content
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert asked(address, "/live.js")[1] == SCRIPT.read_bytes()
    state = json.loads(asked(address, "/state.json")[1])
    assert (state["version"], state["status"]) == (1, "done")
    assert main(["report", str(runs["done"])]) == 0
    assert asked(address, "/page/1.html")[1] == (runs["done"] / "index.html").read_bytes()


@pytest.mark.parametrize(
    "path", ["/page/2.html", "/page/1", "/manifest.json", "/../manifest.json", "/page/../live.py"]
)
def test_there_is_nothing_else(address: str, path: str) -> None:
    assert asked(address, path)[0] == 404


def test_it_is_read_only(address: str) -> None:
    assert asked(address, "/", method="POST")[0] == 501


@pytest.mark.parametrize(
    ("host", "status"),
    [("localhost:80", 200), ("127.0.0.1", 200), ("[::1]:8765", 200), ("evil.example:8765", 403)],
)
def test_no_other_site_may_read_it_by_a_name_of_its_own(
    address: str, host: str, status: int
) -> None:
    """A name that leads here (DNS rebinding) would make a browser hand the run to its owner."""
    assert asked(address, "/state.json", host)[0] == status


def test_a_port_that_is_taken_is_named(address: str, runs: dict[str, Path]) -> None:
    port = int(address.rpartition(":")[2])
    taken = served(LivePages(runs["done"]), "127.0.0.1", port)
    with pytest.raises(LiveError, match=rf"cannot listen at 127.0.0.1:{port}: "), taken:
        pass


@pytest.fixture(scope="module")
def script() -> Iterator[Engine]:
    with engine([SCRIPT]) as found:
        yield found


@pytest.mark.parametrize(
    ("left", "wait", "pace"), [(4, 2, 2), (1, 4, 0.25), (0, 3, 0.05), (900, 3, 30), (1, 0, 10)]
)
def test_the_end_of_a_page_is_reached_when_the_next_one_comes(
    script: Engine, left: float, wait: float, pace: float
) -> None:
    assert script.value("LIVE.pace(left, wait)", left=left, wait=wait) == pace


@pytest.mark.parametrize(
    ("state", "shown", "following", "said"),
    [
        (("running", 12.5), 11.25, "yes", "The run is at 12.50 s. Shown: 11.25 s, 1.25 s behind."),
        (("running", 2.0), 2.5, "yes", "The run is at 2.00 s. Shown: 2.50 s, 0.00 s behind."),
        (
            ("running", 9.0),
            3.0,
            "no",
            "The run is at 9.00 s. Shown: 3.00 s, 6.00 s behind; it is not followed.",
        ),
        (("failed", 9.0), 3.0, "yes", "The run is failed at 9.00 s. Shown: 3.00 s."),
    ],
)
def test_how_far_the_picture_is_behind_is_said(
    script: Engine, state: tuple[str, float], shown: float, following: str, said: str
) -> None:
    told = dict(zip(("status", "reached", "problem"), (*state, ""), strict=True))
    words = "LIVE.words(state, shown, following === 'yes')"
    assert script.value(words, state=told, shown=shown, following=following) == said
    told["problem"] = "gone"
    assert script.value(words, state=told, shown=shown, following=following) == "gone"


@pytest.mark.parametrize(
    ("clock", "now", "told_to"),
    [
        ({"time": 6.0, "playing": True}, 6000, "nothing"),
        ({"time": 10.0, "playing": False}, 8000, "nothing"),
        ({"time": 6.0, "playing": False}, 6000, "stop"),
        ({"time": 3.9, "playing": True}, 6000, "go back"),
        ({"time": 8.5, "playing": True}, 6000, "go on"),
        ({"time": 6.0, "playing": True, "speed": 5}, 6000, "be faster"),
    ],
)
def test_who_moves_the_time_does_not_follow_any_more(
    script: Engine, clock: dict[str, Any], now: int, told_to: str
) -> None:
    """At 5000 ms the clock was told to play from 4 s on, twice as fast, to 10 s."""
    told = {"time": 4.0, "speed": 2.0, "at": 5000.0}
    given = {"span": 10.0, "speed": 2.0, **clock}
    found = script.value("LIVE.isTouched(told, clock, now)", told=told, clock=given, now=now)
    assert found is (told_to != "nothing")


@pytest.mark.parametrize(
    ("playing", "running", "waits"),
    [("true", "true", [50]), ("true", "false", []), ("false", "true", [])],
)
def test_pictures_leave_the_processor_to_a_run_that_goes_on(
    script: Engine, playing: str, running: str, waits: list[int]
) -> None:
    """Who moves a page that does not play waits for nothing."""
    asked = script.value(
        "(() => { const waits = [], frames = [];"
        "const window = { requestAnimationFrame: (next) => frames.push(next),"
        " setTimeout: (act, wait, next) => { waits.push(wait); act(next); } };"
        f"const clock = {{ playing: {playing} }};"
        f"LIVE.calm(clock, window, () => {running});"
        "clock.frame('next'); return [waits, frames]; })()"
    )
    assert asked == [waits, ["next"]]
