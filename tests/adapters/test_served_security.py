"""Components served to other hosts: to runs that have a certificate, and to nobody else."""

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.hosts_file import RUN, Hosts, read_hosts

zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
pytest.importorskip("cryptography", reason="cryptography is not installed")
make_credentials = importlib.import_module("adapters.keys").make_credentials
session = importlib.import_module("adapters.zenoh.session")
session_settings = importlib.import_module("adapters.zenoh.credentials").session_settings
transport = importlib.import_module("adapters.zenoh.transport")
intruder = importlib.import_module("tests.adapters.intruders").intruder

UNIT = """\
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Walk(Component):
    connectors = {
        "u": Connector(causality=Causality.INPUT, start=0.0),
        "y": Connector(causality=Causality.OUTPUT, start=0.0),
    }

    def setup(self, start, rng):
        self.rng, self.y = rng, 0.0

    def step(self, inputs, t, h):
        self.y += float(inputs["u"]) / 2 + self.rng.normal()

    def outputs(self):
        return {"y": np.array(self.y)}
"""
SCENARIO = """\
schema: 1
title: two walks that pull each other
seed: 5
time: {stop: 500 ms}
coupling: {algorithm: jacobi}
components:
  near: {type: "walk.py:Walk", step: 10 ms}
  far: {type: "walk.py:Walk", step: 10 ms, host: gpu}
connections:
  - {from: near.y, to: far.u}
  - {from: far.y, to: near.u}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "walk.py").write_text(UNIT)
    (tmp_path / "two.yaml").write_text(SCENARIO)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def hosts(folder: Path) -> Hosts:
    port = transport._free_port()
    file = folder / "hosts.yaml"
    file.write_text(
        "credentials: keys\nhosts:\n"
        f'  gpu: {{endpoint: "tls/127.0.0.1:{port}"}}\n'
        f'  partner: {{endpoint: "tls/127.0.0.1:{port}"}}\n'
    )
    hosts = read_hosts(file)
    make_credentials(hosts, datetime.now(UTC), 2)
    return hosts


@contextmanager
def serving(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """`nlosim serve` as another process; it has said that it is ready."""
    command = [sys.executable, "-c", "from orchestrator.cli import main; raise SystemExit(main())"]
    served = subprocess.Popen(
        [*command, "serve", "two.yaml", "far", "--once"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**importlib.import_module("orchestrator.remote.process").child_environment()},
    )
    try:
        assert served.stdout is not None
        line = served.stdout.readline()
        assert "ready on host `gpu`" in line, line + served.stdout.read()
        yield served
    finally:
        served.terminate()
        served.communicate()


def fingerprint(capsys: pytest.CaptureFixture[str], *options: str) -> str:
    """The fingerprint of a run."""
    code = main(["run", "two.yaml", "--quiet", "--no-figure", "--json", *options])
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert code == 0, said
    found: str = said["fingerprint"]
    return found


def ask(asking: Any, key: str, request: Any, timeout: float = 20.0) -> list[bytes]:
    """The answers to a request."""
    return [
        reply.ok.payload.to_bytes()
        for reply in asking.get(key, payload=json.dumps(request).encode(), timeout=timeout)
        if reply.ok is not None
    ]


def test_only_runs_may_ask_and_command(
    hosts: Hosts, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another host of the file is let in and gets no answer; the run has its fingerprint."""
    alone = fingerprint(capsys, "--out", "alone")
    endpoint = str(hosts.endpoint("gpu"))
    key = session.meeting_key("far")
    request = {"run": "0123456789abcdef", "name": "two", "statement": {}}
    with serving(folder) as served:
        settings = session_settings(hosts, "partner", listens=False)
        with intruder(endpoint, **{**settings, "connect/timeout_ms": 20000}) as partner:
            assert ask(partner, key, request, 0.5) == []
            tokens = partner.liveliness().get("cs/@v1/**", timeout=0.5)
            assert [str(each.ok.key_expr) for each in tokens if each.ok is not None] == []
            partner.put(session.Keys("0123456789abcdef", "far").command, b"nonsense")
            together = fingerprint(capsys, "--out", "together", "--hosts", "hosts.yaml")
        assert served.wait(60) == 0
    assert together == alone


def test_who_has_the_certificate_of_runs_is_answered(hosts: Hosts, folder: Path) -> None:
    """What it is refused for: not saying what it means. So silence above is access control."""
    endpoint = str(hosts.endpoint("gpu"))
    request = {"run": "0123456789abcdef", "name": "two", "statement": {}}
    with serving(folder):
        settings = session_settings(hosts, RUN, listens=False)
        with intruder(endpoint, **{**settings, "connect/timeout_ms": 20000}) as run:
            (answer,) = ask(run, session.meeting_key("far"), request)
            assert "install the same release at both ends" in json.loads(answer)["refused"][0]
            (other,) = ask(run, session.meeting_key("other"), request)
            assert json.loads(other) == {"serves": ["far"]}


def remade(hosts: Hosts, folder: Path, since: datetime, *files: str) -> None:
    """Put other credentials for the same hosts, of an authority of their own, in place of some."""
    text = hosts.path.read_text().replace("credentials: keys", "credentials: others")
    (folder / "others.yaml").write_text(text)
    make_credentials(read_hosts(folder / "others.yaml"), since, 2)
    for name in files:
        (folder / "keys" / name).write_bytes((folder / "others" / name).read_bytes())


@pytest.mark.parametrize(
    ("days", "files", "said"),
    [
        (0, "", "nobody answers at host `gpu` (tls/127.0.0.1:"),
        (0, "authority.pem", "): its certificate is not accepted here: unable to get "),
        (0, "run.pem run-key.pem", "/keys/run.pem`: decrypt error; both sides need credentials"),
        (30, "run.pem run-key.pem", "/keys/run.pem`: certificate expired; both sides need "),
    ],
    ids=["nobody", "another authority", "another run", "expired"],
)
def test_who_is_refused_for_a_certificate_hears_so(  # noqa: PLR0917 - fixtures
    days: int,
    files: str,
    said: str,
    hosts: Hosts,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of either side; who finds nobody hears that."""
    text = (folder / "two.yaml").read_text()
    patient = text.replace("host: gpu", "host: gpu, deadline: {create: 1 s}")
    with serving(folder) if files else nullcontext():
        remade(hosts, folder, datetime.now(UTC) - timedelta(days=days), *files.split())
        (folder / "two.yaml").write_text(patient)
        assert main(["run", "two.yaml", "--hosts", "hosts.yaml", "--out", "out"]) == 3
    error = capsys.readouterr().err
    assert said in error
    assert ("nobody answers" in error) is (files == "")
