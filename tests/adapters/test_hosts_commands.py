"""What `check`, `graph`, `run` and `serve` say of hosts."""

import json
from pathlib import Path

import pytest
import zenoh

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.hosts_file import read_hosts
from orchestrator.placement import placement
from orchestrator.scenario.build import load_scenario
from tests.adapters.hosting import SCENARIO, Site, free_port, until

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")


@pytest.fixture
def site(tmp_path: Path) -> Site:
    text = SCENARIO.replace("host: gpu", "host: partner")
    return Site(tmp_path / "site", text, {"partner": free_port()})


def said(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str]:
    code = main([*map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out + captured.err


def secret(site: Site) -> None:
    """Let the code of two components be somewhere else."""
    head, far, rest = site.scenario.read_text().partition("  far: ")
    site.scenario.write_text(head + far + rest.replace("parts:", "secret:", 2))


def test_check_says_what_hosts_mean(site: Site, capsys: pytest.CaptureFixture[str]) -> None:
    code, text = said(capsys, "check", site.scenario)
    names = "`near`, `far`, `apart`"
    effect = "takes effect with `nlosim run --hosts FILE`, and `nlosim serve` there"
    assert (code, text.splitlines()) == (
        0,
        [
            f"{site.scenario}: ok, 4 components, 4 connections",
            f"{site.scenario}:6:45: {names}: `host: partner` {effect}; without it they run here",
        ],
    )


def test_check_asks_hosts(site: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """They are free again afterwards, and nobody has run anything."""
    with site.serving("partner", "near", "far", "apart") as lines:
        for _ in range(2):
            code, text = said(capsys, "check", site.scenario, "--hosts", site.hosts)
            assert code == 0
            assert text.splitlines()[-1].endswith("`host: partner` were found there")
        other = site.folder / "other.txt"  # a server that reads it meanwhile reads all of it
        other.write_text(site.code.read_text().replace('"y"', '"z"'))
        other.replace(site.code)
        code, text = said(capsys, "check", site.scenario, "--hosts", site.hosts)
        assert until(lambda: lines.count("`far`: the run `ring` has ended") >= 2)
    assert code == 2
    assert f"{site.scenario}:9" not in text
    assert "connections[0]" in text


def test_what_is_not_here_is_left_out_of_the_check_and_said(
    site: Site, capsys: pytest.CaptureFixture[str]
) -> None:
    secret(site)
    code, text = said(capsys, "check", site.scenario)
    there = f"there is no file `{site.folder}/secret.py` for `secret:Follow`"
    elsewhere = "it is for the host `partner`, which takes `--hosts FILE`"
    lines = text.splitlines()
    assert code == 0
    assert lines[0] == (
        f"{site.scenario}:7:15: components.far.type: {there}; {elsewhere} (a remark)"
    )
    assert lines[2] == (
        f"{site.scenario}: ok without `far`, `apart`, which cannot be checked here, "
        "4 components, 4 connections"
    )
    site.scenario.write_text(
        site.scenario.read_text().replace("here.y, to: near.u", "here.x, to: near.u")
    )
    code, text = said(capsys, "check", site.scenario)
    assert code == 2
    assert "`here.x`" in text or "`here` has no" in text


def test_graph_says_who_is_where(site: Site, capsys: pytest.CaptureFixture[str]) -> None:
    code, text = said(capsys, "graph", site.scenario)
    assert code == 0
    (row,) = (line for line in text.splitlines() if " far " in line and "every" in line)
    assert row.endswith("host `partner` with --hosts, else this process")
    svg = site.folder / "graph.svg"
    code, text = said(capsys, "graph", site.scenario, "--json", "--svg", svg)
    hosts = {each["name"]: each.get("host") for each in json.loads(text)["components"]}
    assert hosts == {"here": None, "near": "partner", "far": "partner", "apart": "partner"}
    assert "every 20 ms, host partner" in svg.read_text()


def test_graph_asks_hosts_for_what_is_not_here(
    site: Site, capsys: pytest.CaptureFixture[str]
) -> None:
    (site.folder / "secret.py").write_text(site.code.read_text())
    secret(site)
    with site.serving("partner", "near", "far", "apart"):
        (site.folder / "secret.py").rename(site.folder / "moved.py")
        assert said(capsys, "graph", site.scenario)[0] == 2
        (site.folder / "moved.py").rename(site.folder / "secret.py")
        code, text = said(capsys, "graph", site.scenario, "--hosts", site.hosts)
    assert code == 0
    assert "far -> apart" in text


def test_a_host_can_be_set(site: Site) -> None:
    change = ["components.here.host=gpu", "components.far.host=null"]
    uses = load_scenario(site.scenario, change).components
    assert [use.host for use in uses.values()] == ["gpu", "partner", None, "partner"]
    with pytest.raises(ScenarioError) as caught:
        load_scenario(site.scenario, ["components.here.host=a b"])
    assert "`a b` cannot be the name of a host; write letters, digits" in str(caught.value)


def test_a_component_that_writes_here_cannot_be_on_a_host(site: Site) -> None:
    text = site.scenario.read_text()
    sink = "sink: {type: table-sink, step: 10 ms, host: partner, parameters: "
    sink += "{file: out.csv, columns: [y]}}"
    site.scenario.write_text(text.replace("connections:", f"  {sink}\nconnections:", 1))
    scenario = load_scenario(site.scenario)
    with pytest.raises(ScenarioError) as caught:
        placement(None, scenario, read_hosts(site.hosts))
    what = "components.sink: writes into the directory of the run, which is here; remove `host`"
    assert what in str(caught.value)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["fra"], "components: there is no component `fra`; did you mean `far`?"),
        (["here"], "components: which host is this? the scenario names none; use --host"),
        (["far", "--host", "partnr"], "there is no host `partnr` in {hosts}; did you mean `par"),
        (["--set", "components.near.host=gpu"],
         "components: which host is this? the scenario names `gpu`, `partner`; use --host"),
        (["far", "--set", "components.far.parameters.rate=x"], "components.far.parameters.rate: "),
    ],
)  # fmt: skip
def test_serve_refuses_what_it_cannot_do(
    site: Site, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    code, text = said(capsys, "serve", site.scenario, *words)
    assert code == 2
    assert told.format(hosts=site.hosts) in text


def test_serve_needs_a_hosts_file(site: Site, capsys: pytest.CaptureFixture[str]) -> None:
    site.hosts.unlink()
    code, text = said(capsys, "serve", site.scenario)
    assert code == 2
    assert "there is no `hosts.yaml` beside the scenario, which says where to listen" in text


def test_serve_needs_the_component(site: Site, capsys: pytest.CaptureFixture[str]) -> None:
    secret(site)
    code, text = said(capsys, "serve", site.scenario, "far")
    assert code == 2
    assert f"{site.scenario}:7:15: components.far.type: there is no file" in text


def test_a_port_that_is_taken_is_named_at_its_line(
    site: Site, capsys: pytest.CaptureFixture[str]
) -> None:
    with site.serving("partner", "near"):
        code, text = said(capsys, "serve", site.scenario, "far")
    assert code == 2
    where = f"{site.hosts}:2:23: hosts.partner.endpoint: cannot listen there"
    advice = "end who listens there, e.g. another `nlosim serve`, or write another port"
    assert text.splitlines()[-1] == f"{where}: Address already in use; {advice}"


def test_an_address_of_another_machine_is_named_at_its_line(
    site: Site, capsys: pytest.CaptureFixture[str]
) -> None:
    """192.0.2.0/24 is for examples (RFC 5737): nobody has it."""
    elsewhere = "{endpoint: tcp/192.0.2.7:7447, insecure: true}"
    site.hosts.write_text(f"hosts:\n  partner: {elsewhere}\n")
    code, text = said(capsys, "serve", site.scenario, "far", "--host", "partner")
    assert code == 2
    where = f"{site.hosts}:2:23: hosts.partner.endpoint: cannot listen there"
    advice = "write an address that this machine has"
    assert text.splitlines()[-1] == f"{where}: Cannot assign requested address; {advice}"


def test_what_the_system_has_not_said_is_what_zenoh_says(
    site: Site, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the places in its sources."""

    def lobby(*_: object) -> None:
        raise zenoh.ZError("No certificate chain found at /registry/src/zenoh-link-tls/utils.rs:87")

    monkeypatch.setattr("adapters.zenoh.network.ZenohLobby", lobby)
    code, text = said(capsys, "serve", site.scenario, "far")
    assert code == 2
    where = f"{site.hosts}:2:23: hosts.partner.endpoint: cannot listen there"
    assert text.splitlines()[-1] == f"{where}: No certificate chain found"


def test_a_limit_of_a_component_on_a_host_takes_no_process(site: Site) -> None:
    text = site.scenario.read_text()
    site.scenario.write_text(text.replace("apart: {", "apart: {deadline: 5 s, "))
    assert load_scenario(site.scenario).components["apart"].limits.deadlines.step == 5.0
    site.scenario.write_text(text.replace("here: {", "here: {deadline: 5 s, "))
    with pytest.raises(ScenarioError, match="is for components in a process of their own"):
        load_scenario(site.scenario)
