"""Steps whose values are laid out, over Zenoh: the bytes of one process, whatever happens."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from adapters.zenoh import ZenohTransport
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.plan import layouts
from orchestrator.reaping import children_of
from tests.orchestrator.mixers import IN_TURN, KINDS, Members, Net, link
from tests.ran import MS, check_equal

pytestmark = pytest.mark.skipif(layouts.engine() is None, reason="needs the engine")

RING = [link(k, (k + 1) % 3, kind) for k in range(3) for kind in KINDS]


@pytest.mark.parametrize("algorithm", [Jacobi(), IN_TURN], ids=["jacobi", "gauss-seidel"])
def test_a_ring_gives_the_bytes_of_one_process(algorithm: object, tmp_path: Path) -> None:
    net = Net([(True, 1, {}), (True, 2, {}), (True, 1, {"deed": "give_view"})], RING)
    here = net.run(tmp_path / "here", elsewhere=False, algorithm=algorithm)
    there = net.run(tmp_path / "there", algorithm=algorithm, transport=ZenohTransport)
    assert not here.error
    check_equal(here, there)


def test_a_death_is_told_by_its_name(tmp_path: Path) -> None:
    members: Members = [(True, 1, {}), (True, 1, {"deed": "die", "at": 9}), (True, 1, {})]
    before = time.monotonic()
    ran = Net(members, RING).run(tmp_path / "run", transport=ZenohTransport)
    assert ran.error == "component `m1` at t = 0.008 s: its process was killed by SIGKILL"
    assert time.monotonic() - before < 20


@pytest.mark.slow
def test_whoever_was_stopped_longer_than_the_lease_goes_on(tmp_path: Path) -> None:
    """The whole run is stopped for 7 s, then a host for as long; nobody is blamed."""
    program = (
        "from pathlib import Path; from adapters.zenoh import ZenohTransport\n"
        "from tests.adapters.test_zenoh_linked_steps import RING\n"
        "from tests.orchestrator.mixers import Net\nfrom tests.ran import MS\n"
        "from orchestrator.limits import Deadlines, Limits\n"
        "more = {f'm{k}': Limits(deadlines=Deadlines(step=60.0)) for k in range(3)}\n"
        "net = Net([(True, 1, {'pause': 0.01}) for _ in range(3)], RING)\n"
        f"ran = net.run(Path({str(tmp_path / 'there')!r}), transport=ZenohTransport,\n"
        "              stop=800 * MS, limits=more)\n"
        "print(ran.fingerprint, ran.error)\n"
    )
    net = Net([(True, 1, {}) for _ in range(3)], RING)
    here = net.run(tmp_path / "here", elsewhere=False, stop=800 * MS)
    run = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    threading.Thread(target=stop_twice, args=(run.pid,), daemon=True).start()
    said, _ = run.communicate(timeout=120)
    assert said.split() == [here.fingerprint]


def stop_twice(run: int) -> None:
    """Stop a run, and then one of its hosts, for longer than the lease."""
    while len(children_of(run)) < 3:
        time.sleep(0.05)
    time.sleep(4.0)
    for stopped in (run, children_of(next(iter(children_of(run))))[0]):
        os.kill(stopped, signal.SIGSTOP)
        time.sleep(7.0)
        os.kill(stopped, signal.SIGCONT)
        time.sleep(0.5)
