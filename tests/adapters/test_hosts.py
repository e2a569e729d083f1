"""Components on other hosts: the same bytes as here, and every way in which parties can differ."""

import threading
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from orchestrator.errors import ComponentError, ScenarioError
from orchestrator.provenance import nlosim_version
from orchestrator.recording import Recording
from orchestrator.remote.protocol import VERSION
from orchestrator.run_outcome import RunFailedError
from orchestrator.scenario.model import ComponentUse
from orchestrator.serving.server import Server
from orchestrator.signal import Connector
from orchestrator.statement import Statement, connectors_of, statement
from tests.adapters.hosting import SCENARIO, Proxy, Site, free_port, until, write_hosts

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")


OURS = nlosim_version()
FILE = "the scenario file differs in"
SET = "with what `--set` says, it differs in `parameters.rate`"


@pytest.fixture
def ports() -> dict[str, int]:
    return {"gpu": free_port(), "partner": free_port()}


@pytest.fixture
def site(tmp_path: Path, ports: dict[str, int]) -> Site:
    """That of the run."""
    return Site(tmp_path / "site", SCENARIO, ports)


@pytest.fixture
def partner(tmp_path: Path, ports: dict[str, int]) -> Site:
    """That of the host `partner`, a copy."""
    return Site(tmp_path / "partner", SCENARIO, ports)


ONE = "components.near.host=null"


def refused(site: Site, *overrides: str) -> list[str]:
    """What is said of a run that begins in no directory."""
    with pytest.raises(ScenarioError) as caught:
        site.run("refused", ONE, *overrides)
    assert not (site.folder / "refused").exists()
    return [str(each).removeprefix(f"{site.scenario}:") for each in caught.value.problems]


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_the_same_bytes_here_in_processes_and_on_two_hosts(
    site: Site, partner: Site, algorithm: str
) -> None:
    """Three parties: two components on one host, one on another, one here; also in processes."""
    chosen = f"coupling.algorithm={algorithm}"
    here = site.run("here", chosen, away=False)
    apart = [f"components.{name}.process=true" for name in ("here", "near")]
    local = site.run("local", chosen, *apart, away=False)
    with site.serving("gpu", "near"), partner.serving("partner", "far", "apart", processes=True):
        hosts = site.run("hosts", chosen, "components.here.process=true")
    assert here.fingerprint == local.fingerprint == hosts.fingerprint
    manifest = Recording(site.folder / "hosts").manifest
    assert {name: each["host"] for name, each in manifest["hosts"].items()} == {
        "near": "gpu",
        "far": "partner",
        "apart": "partner",
    }
    text = (site.folder / "hosts" / "manifest.json").read_text()
    assert "127.0.0.1" not in text
    assert manifest["hosts"]["far"]["files"].keys() == {"parts.py"}


def test_one_run_after_the_other_finds_a_new_component(site: Site, partner: Site) -> None:
    with partner.serving("partner", "far", "apart") as said:
        prints = {site.run(f"run-{k}", ONE).fingerprint for k in range(3)}
    assert prints == {site.run("here", away=False).fingerprint}
    assert sorted(said) == sorted(
        f"`{name}`: the run `ring` has {what}"
        for name in ("far", "apart")
        for what in (*["come"] * 3, *["ended at t = 0.1 s"] * 3)
    )


def test_a_host_needs_what_the_run_lacks(site: Site, partner: Site) -> None:
    """The run has no code of the partner's: it sees the connectors, and nothing else."""
    expected = site.run("here", away=False).fingerprint
    for each in (site, partner):
        head, far, rest = each.scenario.read_text().partition("  far: ")
        each.scenario.write_text(head + far + rest.replace("parts:", "secret:", 2))
    (partner.folder / "secret.py").write_text(partner.code.read_text())
    with partner.serving("partner", "far", "apart"):
        assert site.run("hosts", ONE).fingerprint == expected
    manifest = Recording(site.folder / "hosts").manifest
    assert manifest["scenario"]["components"]["far"]["parameters"] == {"rate": 2}
    with pytest.raises(ScenarioError) as caught:
        site.run("alone", away=False)
    assert [str(each).removeprefix(f"{site.scenario}:") for each in caught.value.problems] == [
        f"{line}: components.{name}.type: there is no file `{site.folder}/secret.py` for "
        "`secret:Follow`; it is for the host `partner`, which takes `--hosts FILE`"
        for line, name in (("7:15", "far"), ("8:17", "apart"))
    ]


def test_data_of_a_host_need_not_be_here(site: Site, partner: Site) -> None:
    expected = site.run("here", away=False).fingerprint
    for each in (site, partner):
        text = each.scenario.read_text().replace("{rate: 2}", "{rate: 2, data: secret.csv}")
        each.scenario.write_text(text)
    (partner.folder / "secret.csv").write_text("1\n")
    with partner.serving("partner", "far", "apart"):
        assert site.run("hosts", ONE).fingerprint == expected
    with pytest.raises(ScenarioError) as caught:
        site.run("alone", away=False)
    what = f"there is no file {site.folder}/secret.csv (paths are relative to the scenario file)"
    end = "it is for the host `partner`, which takes `--hosts FILE`"
    where = f"{site.scenario}:7:87: components.far.parameters.data"
    assert str(caught.value) == f"{where}: {what}; {end}"


def test_a_connection_to_what_a_host_lacks_is_refused_at_its_line(
    site: Site, partner: Site
) -> None:
    for each in (site, partner):
        each.scenario.write_text(each.scenario.read_text().replace("far.y", "far.z"))
    with partner.serving("partner", "far", "apart"):
        (problem,) = refused(site)
    assert problem.startswith("12:5: connections[2]: ")
    assert "`far`" in problem


@pytest.mark.parametrize(
    ("change", "overrides", "told"),
    [
        (("rate: 2", "rate: 3"), (), f"{FILE} `components.far.parameters.rate`; {SET}"),
        (("stop: 100 ms", "stop: 200 ms"), (), f"{FILE} `time.stop`"),
        (("from: here.y", "from: apart.y"), (), f"{FILE} `connections[0].from`"),
        (("", ""), ("components.far.parameters.rate=4",), SET),
    ],
)
def test_what_the_scenarios_do_not_agree_upon_is_named(
    site: Site, partner: Site, change: tuple[str, str], overrides: tuple[str, ...], told: str
) -> None:
    old, new = change
    partner.scenario.write_text(partner.scenario.read_text().replace(old, new))
    with partner.serving("partner", "far", "apart") as said:
        problems = refused(site, *overrides)
    assert problems[0] == f"7:3: `far` on host `partner`: {told}"
    assert f"`far`: refused the run `ring`: {told}" in said


def test_what_only_others_are_set_to_is_no_difference(site: Site, partner: Site) -> None:
    """Nor the seed, nor where a component runs and how long it may take."""
    chosen = ("seed=7", "components.here.parameters.rate=5", "time.stop=60 ms")
    with partner.serving("partner", "far", "apart", overrides=["components.far.deadline.step=9"]):
        run = site.run("hosts", ONE, *chosen)
    assert run.fingerprint == site.run("here", *chosen, away=False).fingerprint


def test_other_code_is_named(site: Site, partner: Site) -> None:
    partner.code.write_text(partner.code.read_text() + "\n# another version\n")
    with partner.serving("partner", "far", "apart"):
        problems = refused(site)
    assert problems == [
        f"{line}:3: `{name}` on host `partner`: the file `parts.py` is not the same here and there"
        for line, name in ((7, "far"), (8, "apart"))
    ]


def test_code_that_was_mended_meanwhile_is_loaded_anew(site: Site, partner: Site) -> None:
    sound = partner.code.read_text()
    partner.code.write_text(sound + "\n# another version\n")
    with partner.serving("partner", "far", "apart") as said:
        refused(site)
        partner.code.write_text(sound)
        run = site.run("hosts", ONE)
    assert run.fingerprint == site.run("here", away=False).fingerprint
    assert "`far`: its scenario or its files have changed; created anew" in said


def test_other_connectors_are_named(site: Site, partner: Site) -> None:
    """The files are the same; what they make is not, as where a library has another version."""
    with partner.serving("partner", "far", "apart"):

        def other(use: ComponentUse) -> dict[str, Connector]:
            return {n: c for n, c in (connectors_of(use) or {}).items() if n != "pid"}

        with patch("orchestrator.placement.connectors_of", other):
            problems = refused(site)
    assert problems[0] == (
        "7:3: `far` on host `partner`: `pid` is missing here and output <i8 there"
    )


@pytest.mark.parametrize(
    ("what", "value", "told"),
    [
        (
            "nlosim_version",
            lambda: "0.0.1",
            f"nlosim 0.0.1 is here and {OURS} there (messages of version {VERSION} and {VERSION})",
        ),
        (
            "VERSION",
            2,
            f"nlosim {OURS} is here and {OURS} there (messages of version 2 and {VERSION})",
        ),
    ],
)
def test_another_release_is_named(
    site: Site, partner: Site, what: str, value: Any, told: str
) -> None:
    def older(*arguments: Any) -> Statement:
        with patch(f"orchestrator.statement.{what}", value):
            return statement(*arguments)

    with (
        partner.serving("partner", "far", "apart") as said,
        patch("orchestrator.placement.statement", older),
    ):
        problems = refused(site)
    end = "; install the same release at both ends"
    assert problems[0] == f"7:3: `far` on host `partner`: {told}{end}"
    assert any("refused the run `ring`: nlosim" in line for line in said)


def test_a_component_that_is_not_served_is_named(site: Site, partner: Site) -> None:
    with partner.serving("partner", "apart"):
        assert refused(site) == ["7:3: `far` on host `partner`: it serves `apart`, not this one"]


def test_an_unknown_host_is_named_at_its_line(site: Site) -> None:
    site.hosts.write_text(site.hosts.read_text().replace("partner:", "partnr:"))
    assert refused(site) == [
        f"{where}: components.{name}.host: there is no host `partner` in {site.hosts}; "
        "did you mean `partnr`?"
        for where, name in (("7:50", "far"), ("8:52", "apart"))
    ]


def test_where_nobody_is_the_run_waits_and_says_so(site: Site, ports: dict[str, int]) -> None:
    lines: list[str] = []
    short = [f"components.{name}.deadline.create=0.8" for name in ("far", "apart")]
    with pytest.raises(ComponentError) as caught:
        site.run("nobody", ONE, *short, tell=lines.append)
    nobody = f"nobody answers at host `partner` (tcp/127.0.0.1:{ports['partner']})"
    assert lines == [f"waiting for `far`: {nobody}; `apart`: {nobody}"]
    ending = "for 0.8 s; its `deadline.create` allows no more"
    assert str(caught.value) == f"component `far`: {nobody}, {ending}"
    assert not (site.folder / "nobody").exists()


def test_the_run_begins_when_all_are_there(site: Site, partner: Site) -> None:
    """The first to come is free again if the run gives up; and waits for the last if not."""
    expected = site.run("here", away=False).fingerprint
    lines: list[str] = []
    found: list[str] = []

    def run() -> None:
        found.append(site.run("hosts", tell=lines.append).fingerprint)

    with partner.serving("partner", "far", "apart") as said:
        thread = threading.Thread(target=run)
        thread.start()
        assert until(lambda: bool(lines) and len(said) == 2)
        assert lines[0].startswith("waiting for `near`: nobody answers at host `gpu` (tcp/")
        assert sorted(said) == [f"`{n}`: the run `ring` has come" for n in ("apart", "far")]
        assert not (site.folder / "hosts").exists()
        with site.serving("gpu", "near"):
            thread.join(30)
    assert found == [expected]


def test_a_run_that_did_not_hear_that_it_is_welcome_asks_again(
    site: Site, partner: Site, ports: dict[str, int]
) -> None:
    """The connection is cut as soon as the server has let it in; another run would wait."""
    expected = site.run("here", away=False).fingerprint
    with partner.serving("partner", "far", "apart") as said, Proxy(ports["partner"]) as proxy:
        write_hosts(site.hosts, {"gpu": 1, "partner": proxy.port})
        real = Server.welcome

        def cutting(*arguments: Any) -> None:
            real(*arguments)
            proxy.cut_all()

        with patch.object(Server, "welcome", cutting):
            assert site.run("hosts", ONE).fingerprint == expected
        assert proxy.cuts == 2
    assert sum("has come" in line for line in said) == 2


def test_a_second_run_at_once_waits_for_its_turn(site: Site, partner: Site) -> None:
    """The first run goes on when the other ones have seen that it is there."""
    lines: list[str] = []
    found: list[str] = []
    mark = site.folder / "mark"
    held = (ONE, "components.here.parameters.deed=wait", f"components.here.parameters.mark={mark}")

    def run(out: str) -> None:
        found.append(site.run(out, *held, tell=lines.append).fingerprint)

    with partner.serving("partner", "far", "apart") as said:
        first, last = (threading.Thread(target=run, args=(out,), daemon=True) for out in "ac")
        first.start()
        assert until(lambda: len(said) == 2)
        short = [f"components.{name}.deadline.setup=0.2" for name in ("far", "apart")]
        with pytest.raises(ComponentError) as caught:
            site.run("b", ONE, *short)
        assert "`far`: host `partner`: the run `ring` has it" in str(caught.value)
        assert "for 0.2 s; its `deadline.create` allows no more" in str(caught.value)
        last.start()
        assert until(lambda: bool(lines))
        mark.touch()
        for each in (first, last):
            each.join()
    assert "host `partner`: the run `ring` has it" in lines[0]
    assert len(found) == 2
    assert len(set(found)) == 1


@pytest.mark.slow
def test_a_component_that_died_on_its_host_is_started_again(
    site: Site, partner: Site, caplog: pytest.LogCaptureFixture
) -> None:
    """It goes on to the same results; the server has made another one meanwhile."""
    mark = partner.folder / "mark"
    for each in (site, partner):
        text = each.scenario.read_text().replace("step: 20 ms", "step: 10 ms")
        each.scenario.write_text(
            text.replace("rate: 2", f'rate: 2, deed: die_once, mark: "{mark}"').replace(
                "far: {", "far: {on_failure: restart, "
            )
        )
    mark.touch()
    expected = site.run("unharmed", away=False).fingerprint
    mark.unlink()
    with partner.serving("partner", "far", "apart", processes=True) as said:
        assert site.run("hosts", ONE).fingerprint == expected
    assert mark.exists()
    lost = "`far` was lost at t = 0.03 s: its process was killed by SIGKILL; it wrote last:"
    assert f"{lost}\n    goodbye" in said
    again = [r.getMessage() for r in caplog.records if "is started again" in r.getMessage()]
    assert len(again) == 1
    assert again[0].startswith("component `far` at t = 0.03 s: on host `partner`: its process")


def test_an_error_of_a_component_on_a_host_is_its_own(site: Site, partner: Site) -> None:
    """The same message as here, and its traceback in the log of the run."""
    for each in (site, partner):
        text = each.scenario.read_text().replace("rate: 2", "rate: 2, deed: refuse")
        each.scenario.write_text(text.replace("step: 20 ms", "step: 10 ms"))
    with (
        partner.serving("partner", "far", "apart") as said,
        pytest.raises(RunFailedError) as caught,
    ):
        site.run("hosts", ONE)
    assert str(caught.value) == "component `far` at t = 0.03 s: ValueError: the moon is too bright"
    assert "in refuse" in (site.folder / "hosts" / "log.txt").read_text()
    assert "`far`: the run `ring` has ended at t = 0.04 s" in said
