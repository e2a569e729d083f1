"""Values from one component to another of the same server: named by the run, and the same bytes."""

import threading
from collections import Counter
from pathlib import Path

import pytest

from adapters.zenoh.served_link import ServedLink
from orchestrator.hosts_file import read_hosts
from orchestrator.remote.block import NAMED, entries
from orchestrator.remote.protocol import Kind, Message
from orchestrator.run_outcome import RunFailedError
from tests.adapters.hosting import Proxy, Site, free_port, until, write_hosts

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

FIELDS = '''

class Field(Component, PortableState):
    """Adds noise to a field and to a text; every third step leaves the field as it was."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        deed: str = parameter("", doc="what it does at 0.03 s")
        mark: str = parameter("", doc="the path of what it leaves when it dies")

    connectors: Mapping[str, Connector] = {
        "field": Connector(causality=Causality.INPUT, shape=(1000,)),
        "text": Connector(causality=Causality.INPUT, dtype=None),
        "f": Connector(causality=Causality.OUTPUT, shape=(1000,)),
        "t": Connector(causality=Causality.OUTPUT, dtype=None),
    }

    def __init__(self, parameters):
        self._p = parameters

    def setup(self, start, rng):
        self._rng, self._f, self._t, self._n = rng, np.zeros(1000), bytes(600), 0

    def step(self, inputs, t, h):
        if t == 30_000_000 and self._p.deed:
            getattr(Follow, self._p.deed)(self)
        self._n += 1
        if self._n % 3:
            self._f = 0.5 * np.asarray(inputs["field"]) + self._rng.normal(size=1000)
        self._t = (inputs["text"] or bytes(600))[1:] + self._rng.bytes(1)

    def outputs(self):
        return {"f": self._f, "t": self._t}

    def die(self):
        Follow.die(self)

    def dump(self):
        numbers = [self._rng.bit_generator.state, self._f.tolist(), self._t.hex(), self._n]
        return json.dumps(numbers).encode()

    def load(self, content):
        self._rng.bit_generator.state, f, t, self._n = json.loads(content)
        self._f, self._t = np.array(f), bytes.fromhex(t)
'''

EVEN = """

from orchestrator.capabilities import InitialEvaluation


class Even(Component, InitialEvaluation):
    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=Causality.INPUT, shape=(100,)),
        "y": Connector(causality=Causality.OUTPUT, shape=(100,), feedthrough=frozenset({"u"})),
    }

    def setup(self, start, rng):
        self._y = rng.normal(size=100)

    def evaluate(self, inputs):
        return {"y": self._y}

    def step(self, inputs, t, h):
        if t >= 30_000_000:
            self._y = self._y + inputs["u"]

    def outputs(self):
        return {"y": self._y}
"""

LOOP = """\
schema: 1
title: Two who try what they give at the start
time: {stop: 100 ms}
coupling: {algorithm: jacobi}
components:
  first: {type: "parts:Even", step: 10 ms, host: partner}
  second: {type: "parts:Even", step: 10 ms, host: partner}
  third: {type: "parts:Even", step: 10 ms, host: partner}
connections:
  - {from: first.y, to: second.u}
  - {from: second.y, to: first.u}
  - {from: first.y, to: third.u}
"""

SCENARIO = """\
schema: 1
title: A ring of fields
time: {stop: 100 ms}
components:
  here: {type: "parts:Field", step: 10 ms}
  first: {type: "parts:Field", step: 10 ms, host: partner}
  second: {type: "parts:Field", step: 20 ms, host: partner}
  third: {type: "parts:Field", step: 10 ms, host: partner}
connections:
  - {from: here.f, to: first.field}
  - {from: here.t, to: first.text}
  - {from: first.f, to: second.field}
  - {from: first.t, to: second.text}
  - {from: second.f, to: third.field}
  - {from: first.t, to: third.text}
  - {from: third.f, to: here.field}
  - {from: second.t, to: here.text}
"""
NAMES = ("first", "second", "third")


class Ear:
    """What goes over the links of a run."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.sent: Counter[str] = Counter()
        self.named: Counter[str] = Counter()
        self.said: Counter[str] = Counter()
        send = ServedLink.send

        def hear(link: ServedLink, message: bytes) -> None:
            command, offset = Message.decode(message)
            if command.kind is Kind.STEP:
                name = link._component
                self.said[name] += 1
                self.sent[name] += len(message)
                self.named[name] += sum(each.form == NAMED for each in entries(message, offset))
            send(link, message)

        monkeypatch.setattr(ServedLink, "send", hear)


@pytest.fixture
def ear(monkeypatch: pytest.MonkeyPatch) -> Ear:
    return Ear(monkeypatch)


@pytest.fixture
def site(tmp_path: Path) -> Site:
    made = Site(tmp_path / "site", SCENARIO, {"partner": free_port()})
    made.code.write_text(made.code.read_text() + FIELDS)
    return made


@pytest.mark.parametrize(
    ("algorithm", "named"),
    [("jacobi", {"second": 8, "third": 12}), ("gauss-seidel", {"second": 10, "third": 14})],
)
def test_what_the_server_has_is_not_sent_to_it(
    site: Site, ear: Ear, algorithm: str, named: dict[str, int]
) -> None:
    """A step of `second` or `third` names up to two values: 8,000 and 600 bytes less.

    What is as it was in the step before is said to be so, as ever: the field of each third step,
    and with Jacobi that of the start. What `here` gives is sent.
    """
    chosen = f"coupling.algorithm={algorithm}"
    expected = site.run("here", chosen, away=False).fingerprint
    with site.serving("partner", *NAMES):
        assert site.run("hosts", chosen).fingerprint == expected
    assert ear.said == {"first": 10, "second": 5, "third": 10}
    assert {name: count for name, count in ear.named.items() if count} == named
    assert ear.sent["first"] > 10 * 5000
    assert ear.sent["second"] < 5 * 400
    assert ear.sent["third"] < 10 * 400


def test_cuts_do_not_confuse_what_is_named(site: Site, ear: Ear) -> None:
    """Commands and replies are repeated, over connections that end in the middle of the run."""
    expected = site.run("here", away=False).fingerprint
    port = read_hosts(site.hosts).endpoints["partner"].port
    ended = threading.Event()
    with site.serving("partner", *NAMES), Proxy(port, delay=0.005, jitter=0.005) as proxy:
        write_hosts(site.hosts, {"partner": proxy.port})

        def spoil() -> None:
            while sum(ear.said.values()) < 5 and not ended.wait(0.01):
                pass
            proxy.cut_all()

        cutting = threading.Thread(target=spoil)
        cutting.start()
        try:
            found = site.run("hosts").fingerprint
        finally:
            ended.set()
            cutting.join()
    assert found == expected
    assert proxy.cuts == 1
    assert proxy.connections >= 2
    assert ear.named["third"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("dies", ["first", "second"])
def test_one_that_starts_anew_gives_and_takes_the_same(site: Site, ear: Ear, dies: str) -> None:
    mark = site.folder / "mark"
    text = site.scenario.read_text().replace("step: 20 ms", "step: 10 ms")
    deed = f'on_failure: restart, parameters: {{deed: die_once, mark: "{mark}"}}'
    site.scenario.write_text(
        text.replace(f'{dies}: {{type: "parts:Field"', f'{dies}: {{{deed}, type: "parts:Field"')
    )
    mark.touch()
    expected = site.run("unharmed", away=False).fingerprint
    mark.unlink()
    with site.serving("partner", *NAMES, processes=True):
        assert site.run("hosts").fingerprint == expected
    assert mark.exists()
    assert ear.named["third"] > 10


def test_values_that_were_tried_at_the_start_are_known_by_that_name(
    tmp_path: Path, ear: Ear
) -> None:
    """The very arrays are given again by those who tried; `third` gets one as its first input."""
    site = Site(tmp_path / "site", LOOP, {"partner": free_port()})
    site.code.write_text(site.code.read_text() + EVEN)
    expected = site.run("here", away=False).fingerprint
    with site.serving("partner", *NAMES):
        assert site.run("hosts").fingerprint == expected
    assert ear.named == dict.fromkeys(NAMES, 6)


def test_two_runs_after_each_other_have_values_of_their_own(site: Site) -> None:
    expected = [site.run(f"here-{seed}", f"seed={seed}", away=False).fingerprint for seed in (1, 2)]
    with site.serving("partner", *NAMES) as said:
        for number, fingerprint in enumerate(expected, 1):
            assert site.run(f"hosts-{number}", f"seed={number}").fingerprint == fingerprint
        assert until(lambda: sum("has ended" in line for line in said) == 6)


def test_a_run_that_names_what_is_not_there_loses_the_component_and_the_server_goes_on(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one that lies, or wants to see what another run has."""
    expected = site.run("here", away=False).fingerprint
    with site.serving("partner", *NAMES) as said:
        with monkeypatch.context() as lying:
            lying.setattr("orchestrator.remote.naming.Name.encode", lambda _: bytes(16) + b"third")
            with pytest.raises(RunFailedError) as failed:
                site.run("lies")
        what = "the run names a value of `third` that is not here"
        assert what in str(failed.value)
        assert any(what in line for line in said)
        assert site.run("hosts").fingerprint == expected
