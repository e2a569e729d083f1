"""Runs with components on other hosts that were cut off, and are gone on with."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from typing_extensions import override

from orchestrator.observer import Observer, SimulationResult
from orchestrator.recording.layout import RecordingError
from orchestrator.resume import go_on, unfinished
from orchestrator.resuming.changes import ChangedError
from orchestrator.run_outcome import RunInterrupted, RunOutcome
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import Time
from tests.adapters.hosting import SCENARIO, Site, free_port

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

MS = 1_000_000
EVERY = 20 * MS


class CutOff(Observer):
    """Interrupts the run at 50 ms, 10 ms after its second checkpoint."""

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if t == 50 * MS:
            raise KeyboardInterrupt

    @override
    def end(self, result: SimulationResult) -> None:
        pass


@pytest.fixture
def site(tmp_path: Path) -> Site:
    text = SCENARIO.replace("host: gpu", "host: partner")
    return Site(tmp_path / "site", text, {"partner": free_port()})


def cut_off(site: Site, every: int | None = EVERY) -> None:
    with pytest.raises(RunInterrupted):
        site.run("out", checkpoint=every, observers=[CutOff()])


def resumed(site: Site, hosts: Path | None = None) -> tuple[RunOutcome, int | None]:
    """What the run came to, and where it was gone on with [ns]."""
    continuation, manifest = unfinished(site.folder / "out")
    assert continuation is not None
    return go_on(continuation, manifest, hosts=hosts), continuation.time


@pytest.mark.slow
def test_a_run_with_hosts_goes_on_from_its_checkpoint(site: Site) -> None:
    """With another server, which knows nothing of the first run; addresses may have changed."""
    expected = site.run("here", away=False).fingerprint
    with site.serving("partner", "near", "far", "apart"):
        cut_off(site)
    with site.serving("partner", "near", "far", "apart", processes=True):
        found, time = resumed(site)
    assert (found.fingerprint, time) == (expected, 40 * MS)


def test_components_on_hosts_that_cannot_save_their_state_step_again(site: Site) -> None:
    text = site.code.read_text().replace("Component, PortableState", "Component")
    site.code.write_text(text)
    expected = site.run("here", away=False).fingerprint
    with site.serving("partner", "near", "far", "apart"):
        cut_off(site)
        found, time = resumed(site)
    assert found.fingerprint == expected
    assert time is None  # nobody can be restored


@pytest.mark.slow
def test_a_component_that_is_started_again_there_goes_on_too(site: Site) -> None:
    """`on_failure: restart` beside checkpoints: it dies after the checkpoint, and once more."""
    mark = site.folder / "mark"
    text = site.scenario.read_text().replace("step: 20 ms", "step: 10 ms")
    text = text.replace("rate: 2", f'rate: 2, deed: die_once, mark: "{mark}"')
    site.scenario.write_text(text.replace("far: {", "far: {on_failure: restart, "))
    mark.touch()
    expected = site.run("here", away=False).fingerprint
    mark.unlink()
    with site.serving("partner", "near", "far", "apart", processes=True) as said:
        cut_off(site)
        assert mark.exists()
        found, time = resumed(site)
    assert (found.fingerprint, time) == (expected, 40 * MS)
    assert sum("`far` was lost at t = 0.03 s" in line for line in said) == 1


def test_without_checkpoints_it_is_made_again_where_it_was(site: Site) -> None:
    """Addresses are not kept then, so the hosts file has to be named."""
    expected = site.run("here", away=False).fingerprint
    with site.serving("partner", "near", "far", "apart"):
        cut_off(site, None)
        with pytest.raises(ChangedError) as caught:
            resumed(site)
        assert "`near` was on host `partner`, which takes `--hosts FILE`; `far` was" in str(
            caught.value
        )
        found, time = resumed(site, site.hosts)
    assert (found.fingerprint, time) == (expected, None)


def test_a_run_without_hosts_is_not_gone_on_with_on_hosts(site: Site) -> None:
    with pytest.raises(RunInterrupted):
        site.run("out", away=False, checkpoint=EVERY, observers=[CutOff()])
    with pytest.raises(ChangedError, match="`far` was here, and is on host `partner` with `--ho"):
        resumed(site, site.hosts)


def test_what_changed_on_a_host_is_named(site: Site, tmp_path: Path) -> None:
    """A file that this side does not have."""
    (tmp_path / "there").mkdir()
    partner = Site(tmp_path / "there" / "site", SCENARIO, {"partner": 1})
    head, far, rest = site.scenario.read_text().partition("  far: ")
    for each in (site, partner):
        each.scenario.write_text(head + far + rest.replace("parts:", "secret:", 1))
    partner.hosts.write_text(site.hosts.read_text())
    secret = partner.folder / "secret.py"
    secret.write_text(partner.code.read_text())
    with partner.serving("partner", "near", "far", "apart"):
        cut_off(site)
        before = {path: path.read_bytes() for path in (site.folder / "out").rglob("*.*")}
        secret.write_text(secret.read_text() + "\n# another version\n")
        with pytest.raises(RecordingError) as caught:
            resumed(site)
    assert str(caught.value) == (
        "the run cannot go on, because something changed since it began: "
        "`secret.py`, which `far` on host `partner` reads, has another content"
    )
    assert {path: path.read_bytes() for path in before} == before
