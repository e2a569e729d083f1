"""Parties that die, are stopped or frozen: who notices, when, and what is said."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from orchestrator.last_call import called
from tests.adapters.hosting import SCENARIO, Site, free_port, until

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")

NLOSIM = [sys.executable, "-m", "orchestrator"]
LONG = "time.stop=100 s"
SLOW = 'far: {type: "parts:Follow", deadline: {step: 4 s}, parameters: {rate: 2, pause: 0.02},'


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """A run of 100 s if nothing happens: `far`, on the host `partner`, takes 20 ms a step."""
    text = SCENARIO.replace("host: gpu", "host: partner").replace(", parameters: {rate: 2}", "")
    text = text.replace('far: {type: "parts:Follow",', SLOW)
    return Site(tmp_path / "site", text, {"partner": free_port()})


class Party:
    """A command in a process of its own, and what it says."""

    def __init__(self, site: Site, *words: str) -> None:
        self.output = site.folder / f"{words[0]}-{time.monotonic_ns()}.txt"
        with self.output.open("w") as stream:
            self.process = subprocess.Popen(
                [*NLOSIM, *words], cwd=site.folder, stdout=stream, stderr=subprocess.STDOUT
            )

    @property
    def said(self) -> str:
        return self.output.read_text()

    def says(self, what: str, within: float = 60.0) -> bool:
        return until(lambda: what in self.said, within)

    def code(self, within: float = 60.0) -> int:
        return self.process.wait(within)


@contextmanager
def party(site: Site, *words: str) -> Iterator[Party]:
    found = Party(site, *words)
    try:
        yield found
    finally:
        if found.process.poll() is None:
            found.process.send_signal(signal.SIGCONT)
            found.process.kill()
            found.process.wait()


@contextmanager
def serving(site: Site, *words: str) -> Iterator[Party]:
    with party(site, "serve", "ring.yaml", *words) as found:
        assert found.says("ready on host `partner`"), found.said
        yield found


@contextmanager
def running(site: Site, out: str = "out", *words: str) -> Iterator[Party]:
    """A run that has begun to step."""
    options = ["--hosts", "hosts.yaml", "--no-figure", "--set", LONG, "--out", out]
    with party(site, "run", "ring.yaml", *options, *words) as found:
        yield found


def begun(site: Site, out: str = "out") -> bool:
    """Whether the run makes steps."""

    def is_stepping() -> bool:
        with suppress(OSError):
            call = called(site.folder / out)
            return call is not None and call.time >= 100_000_000
        return False

    return until(is_stepping, 60.0)


def hurried(site: Site, deadline: str) -> None:
    """Give all components on the host this deadline, in place of what they have."""
    text = site.scenario.read_text().replace("deadline: {step: 4 s}, ", "")
    site.scenario.write_text(text.replace("host: partner", f"host: partner, deadline: {deadline}"))


def error_of(run: Party) -> str:
    (line,) = (each for each in run.said.splitlines() if each.startswith("error: "))
    return line


def manifest(site: Site, out: str = "out") -> dict[str, Any]:
    found: dict[str, Any] = json.loads((site.folder / out / "manifest.json").read_text())
    return found


@pytest.mark.slow
def test_a_server_that_is_killed_is_named_with_the_time(site: Site) -> None:
    with serving(site) as serve, running(site) as run:
        assert begun(site)
        serve.process.kill()
        before = time.monotonic()
        assert run.code() == 3
        assert time.monotonic() - before < 20
    found = re.fullmatch(
        r"error: component `(near|far|apart)` at t = [\d.]+ s: on host `partner`: nobody listens "
        r"there any more; `nlosim serve` has ended or was killed",
        error_of(run),
    )
    assert found, run.said
    assert "lost the connection to host `partner`; it is waited for until its deadline" in run.said
    assert manifest(site)["status"] == "failed"


@pytest.mark.slow
def test_a_run_that_is_killed_is_named_with_the_time(site: Site) -> None:
    """The next one waits until it is sure that the first does not come back."""
    hurried(site, "{setup: 3 s, step: 2 s}")
    with serving(site, "--once") as serve, running(site) as run:
        assert begun(site)
        children = subprocess.run(
            ["pgrep", "-P", str(run.process.pid)], capture_output=True, text=True, check=False
        ).stdout.split()
        for pid in (*children, str(run.process.pid)):
            os.kill(int(pid), signal.SIGKILL)
        assert serve.code() == 3
    for name in ("near", "far", "apart"):
        when = r"at t = [\d.]+ s"
        lost = rf"`{name}`: lost the connection to the run `ring` {when}; it is waited for, for 3 s"
        gone = rf"`{name}`: the run `ring` is gone {when}: nothing was heard of it for 3 s"
        assert re.search(lost, serve.said), serve.said
        assert re.search(gone, serve.said), serve.said


@pytest.mark.slow
def test_ctrl_c_ends_a_server_that_waits(site: Site) -> None:
    with serving(site) as serve:
        serve.process.send_signal(signal.SIGINT)
        assert serve.code() == 4
    assert serve.said.endswith("interrupted\n")
    assert "Traceback" not in serve.said


@pytest.mark.slow
def test_ctrl_c_ends_a_server_in_use_and_the_run_says_why(site: Site) -> None:
    with serving(site) as serve, running(site) as run:
        assert begun(site)
        serve.process.send_signal(signal.SIGINT)
        assert run.code() == 3
        assert serve.code() == 4
    what = "on host `partner`: `nlosim serve` was stopped"
    assert re.fullmatch(rf"error: component `\w+` at t = [\d.]+ s: {what}", error_of(run))
    assert "Traceback" not in serve.said + run.said


@pytest.mark.slow
def test_ctrl_c_ends_a_run_and_the_server_goes_on(site: Site) -> None:
    with serving(site) as serve:
        with running(site) as run:
            assert begun(site)
            run.process.send_signal(signal.SIGINT)
            assert run.code() == 4
        assert until(lambda: serve.said.count("has ended at t = ") == 3, 60)
        with running(site, "again", "--set", "time.stop=40 ms") as run:
            assert run.code() == 0
    assert serve.said.count("has come") == 6


@pytest.mark.slow
def test_ctrl_c_ends_a_run_that_waits_for_a_host(site: Site) -> None:
    with running(site) as run:
        assert run.says("waiting for `near`: nobody answers at host `partner` (tcp/127.0.0.1:")
        run.process.send_signal(signal.SIGINT)
        assert run.code() == 4
    assert not (site.folder / "out").exists()


@pytest.mark.slow
def test_a_server_that_is_stopped_for_a_while_goes_on(site: Site) -> None:
    """For longer than a connection lives, 5 s; the deadline of a step is 30 s."""
    hurried(site, "{step: 30 s}")
    stop = "time.stop=2 s"
    expected = site.run("here", stop, "components.far.parameters.pause=0", away=False).fingerprint
    with serving(site) as serve, running(site, "out", "--set", stop) as run:
        assert begun(site)
        serve.process.send_signal(signal.SIGSTOP)
        assert run.says("lost the connection to host `partner`; it is waited for")
        serve.process.send_signal(signal.SIGCONT)
        assert run.code(60) == 0
    assert f"fingerprint  {expected}" in run.said
    assert "host `partner` is there again" in run.said


@pytest.mark.slow
def test_a_server_that_is_stopped_for_ever_is_given_up_at_the_deadline(site: Site) -> None:
    """Whoever is awaited is named: that depends on when the server is stopped."""
    hurried(site, "{step: 4 s}")
    with serving(site) as serve, running(site) as run:
        assert begun(site)
        serve.process.send_signal(signal.SIGSTOP)
        assert run.code(60) == 3
    late = "did not answer within 4 s (to `step`); its `deadline` allows no more"
    lost = "(; the connection to host `partner` is lost)?"  # that takes 5 s
    what = rf"error: component `(near|far|apart)` at t = [\d.]+ s: {re.escape(late)}{lost}"
    assert re.fullmatch(what, error_of(run))


@pytest.mark.slow
@pytest.mark.parametrize("deed", ["die", "speak"])
def test_what_a_component_says_there_is_in_the_log_of_the_run(site: Site, deed: str) -> None:
    text = site.scenario.read_text().replace("pause: 0.02", f"deed: {deed}")
    site.scenario.write_text(text.replace("step: 20 ms", "step: 10 ms"))
    with serving(site, "--once") as serve:
        with running(site, "out", "--set", "time.stop=60 ms") as run:
            code = run.code()
        assert serve.code() == code
    log = (site.folder / "out" / "log.txt").read_text()
    if deed == "speak":
        assert code == 0
        assert "orchestrator.remote.output: `far`: hello from the part" in log
        assert "WARNING parts: fuel is low" in log
    else:
        assert code == 3
        how = "its process was killed by SIGKILL; it wrote last:\n    goodbye"
        assert f"error: component `far` at t = 0.03 s: on host `partner`: {how}" in run.said
        assert f"`far` was lost at t = 0.03 s: {how}" in serve.said
