"""Runs over bad networks: late, irregular, and cut again and again; and between namespaces."""

import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

import pytest

from adapters.keys.making import make_credentials
from orchestrator.hosts_file import read_hosts
from orchestrator.remote.patience import Patience
from orchestrator.remote.transport import LinkLostError
from tests.adapters.hosting import SCENARIO, Proxy, Site, free_port, until, write_hosts

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

from adapters.zenoh.served_link import ServedLink


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path / "site", SCENARIO, {"gpu": free_port(), "partner": free_port()})


@contextmanager
def behind_proxies(site: Site, *, by_tls: bool = False, **spoilt: float) -> Iterator[list[Proxy]]:
    """Both hosts served; the hosts file of the run leads to proxies before them."""
    if by_tls:
        ports = {name: each.port for name, each in read_hosts(site.hosts).endpoints.items()}
        write_hosts(site.hosts, ports, by_tls=True)
    endpoints = read_hosts(site.hosts).endpoints
    with ExitStack() as stack:
        stack.enter_context(site.serving("gpu", "near"))
        stack.enter_context(site.serving("partner", "far", "apart"))
        proxies = [
            stack.enter_context(Proxy(endpoint.port, seed=k, **spoilt))
            for k, endpoint in enumerate(endpoints.values())
        ]
        ports = dict(zip(endpoints, (proxy.port for proxy in proxies), strict=True))
        write_hosts(site.hosts, ports, by_tls=by_tls)
        yield proxies


@pytest.mark.slow
@pytest.mark.parametrize(
    ("algorithm", "by_tls"), [("jacobi", False), ("gauss-seidel", True)], ids=["tcp", "tls"]
)
def test_20_ms_jitter_and_cuts_change_nothing(site: Site, algorithm: str, *, by_tls: bool) -> None:
    """One piece in fifty is the last of its connection, which is made anew."""
    chosen = f"coupling.algorithm={algorithm}"
    here = site.run("here", chosen, away=False)
    local = site.run("local", chosen, "components.here.process=true", away=False)
    with behind_proxies(site, by_tls=by_tls, delay=0.02, jitter=0.01, cut=0.02) as proxies:
        hosts = site.run("hosts", chosen)
        cuts = sum(proxy.cuts for proxy in proxies)
    assert here.fingerprint == local.fingerprint == hosts.fingerprint
    assert cuts >= 1
    assert sum(proxy.connections for proxy in proxies) > 2


def test_a_cut_in_a_step_and_between_steps_is_made_good(site: Site) -> None:
    """Connections are cut every 0.15 s, and steps take 0.05 s."""
    slow = "components.far.parameters.pause=0.05"
    expected = site.run("here", slow, away=False).fingerprint
    ended = threading.Event()
    head, far, rest = site.scenario.read_text().partition("  far: ")
    site.scenario.write_text(head + far + rest.replace("rate: 2", "rate: 2, pause: 0.05", 1))
    with behind_proxies(site) as proxies:

        def spoil() -> None:
            while not ended.wait(0.15):
                proxies[1].cut_all()

        cutting = threading.Thread(target=spoil)
        cutting.start()
        try:
            found = site.run("hosts").fingerprint
        finally:
            ended.set()
            cutting.join()
        assert proxies[1].cuts >= 2
    assert found == expected


@pytest.mark.parametrize(
    "error", [TimeoutError(), LinkLostError("the connection was lost at once")]
)
def test_a_component_that_is_not_connected_at_first_is_asked_for_anew(
    site: Site, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    """It said that it is free, and the connection to it came too late, or was lost."""
    expected = site.run("here", away=False).fingerprint
    awaited: list[ServedLink] = []
    await_connection = ServedLink.await_connection

    def lost_at_first(link: ServedLink, patience: Patience) -> None:
        await_connection(link, patience)
        awaited.append(link)
        if len(awaited) == 1:
            raise error

    monkeypatch.setattr(ServedLink, "await_connection", lost_at_first)
    with site.serving("gpu", "near"), site.serving("partner", "far", "apart"):
        assert site.run("hosts").fingerprint == expected
    assert len(awaited) == 4  # three components, one of them twice


def can_separate() -> bool:
    """Whether this user may make network namespaces."""
    tools = sys.platform == "linux" and shutil.which("ip") and os.geteuid() == 0
    if not tools:
        return False
    made = subprocess.run(["ip", "netns", "add", "nlosim-probe"], capture_output=True, check=False)
    subprocess.run(["ip", "netns", "del", "nlosim-probe"], capture_output=True, check=False)
    return made.returncode == 0


@pytest.fixture
def namespaces() -> Iterator[tuple[str, str]]:
    """Two network namespaces: 10.77.0.1 in the first, 10.77.0.2 in the second."""
    if not can_separate():
        pytest.skip("network namespaces take root, on Linux, with `ip`")
    names = (f"nlosim-a{os.getpid()}", f"nlosim-b{os.getpid()}")
    ends = (f"va{os.getpid() % 100000}", f"vb{os.getpid() % 100000}")
    try:
        for name in names:
            subprocess.run(["ip", "netns", "add", name], check=True)
        pair = ["type", "veth", "peer", "name", ends[1], "netns", names[1]]
        subprocess.run(["ip", "link", "add", ends[0], "netns", names[0], *pair], check=True)
        for k, (name, end) in enumerate(zip(names, ends, strict=True), 1):
            inside = ["ip", "-n", name]
            subprocess.run([*inside, "addr", "add", f"10.77.0.{k}/24", "dev", end], check=True)
            for device in (end, "lo"):
                subprocess.run([*inside, "link", "set", device, "up"], check=True)
        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], check=False)


@pytest.mark.slow
def test_two_network_namespaces_are_two_hosts(site: Site, namespaces: tuple[str, str]) -> None:
    expected = site.run("here", away=False).fingerprint
    scenario = site.scenario.read_text().replace("host: gpu", "host: partner")
    site.scenario.write_text(scenario)
    site.hosts.write_text(
        'credentials: keys\nhosts:\n  partner: {endpoint: "tls/10.77.0.2:7447"}\n'
    )
    make_credentials(read_hosts(site.hosts), datetime.now(tz=UTC), 1)
    here, there = (["ip", "netns", "exec", name] for name in namespaces)
    command = [sys.executable, "-m", "orchestrator"]
    serve = [*there, *command, "serve", str(site.scenario), "--once"]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as serving:
        try:
            assert serving.stdout is not None
            assert "ready on host `partner` (tls/10.77.0.2:7447)" in serving.stdout.readline()
            run = [*here, *command, "run", str(site.scenario), "--hosts", str(site.hosts)]
            options = ["--out", str(site.folder / "hosts"), "--no-figure", "--quiet"]
            done = subprocess.run([*run, *options], capture_output=True, text=True, check=False)
            assert serving.wait(60) == 0
        finally:
            serving.kill()
    assert f"fingerprint  {expected}" in done.stdout, done.stdout + done.stderr


def test_a_proxy_cuts_what_it_is_told_to() -> None:
    """The instrument itself: what goes through it comes out, late, until it is cut."""
    with (
        socket.create_server(("127.0.0.1", 0)) as listening,
        Proxy(listening.getsockname()[1], delay=0.05) as proxy,
        socket.create_connection(("127.0.0.1", proxy.port)) as near,
    ):
        far, _ = listening.accept()
        with far:
            before = time.monotonic()
            near.sendall(b"abc")
            assert far.recv(3) == b"abc"
            assert time.monotonic() - before >= 0.05
            proxy.cut_all()
            near.settimeout(5)
            with suppress(ConnectionError):
                assert near.recv(1) == b""
        assert until(lambda: proxy.cuts == 1)
