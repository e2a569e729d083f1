"""Instances of an FMU share a library that remembers nothing, and no other one."""

import os
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType, sharing
from adapters.fmi.description import read_description
from adapters.fmi.unpacked import LoadedFmu
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.conftest import HERE, built

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere each has a copy")

STEP = 1_000_000  # [ns]
STEPS = 5


@pytest.fixture(scope="module")
def counting3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As `ends3`, but the steps of all instances in a library are counted in one variable."""
    folder = tmp_path_factory.mktemp("counting3")
    shutil.copytree(HERE / "ends3", folder / "ends3")
    source = folder / "ends3" / "ends3.c"
    own, common = "ends->y = t + h;\n    ends->calls++;", "static fmi3Int32 calls;\n"
    text = source.read_text()
    assert own in text
    source.write_text(text.replace(own, f"{common} ends->y = t + h; ends->calls = ++calls;"))
    return built("ends3", 3, folder, folder)


@contextmanager
def loaded(*paths: Path) -> Iterator[list[LoadedFmu]]:
    """The FMUs, loaded in their order; whoever is not in the list any more is gone already."""
    found = [LoadedFmu(read_description(path), f"c{k}") for k, path in enumerate(paths)]
    try:
        yield found
    finally:
        while found:
            leave(found)


def leave(found: list[LoadedFmu]) -> None:
    """Let go of the first one."""
    fmu = found.pop(0)
    fmu.unload()
    fmu.discard()


def places(found: list[LoadedFmu]) -> set[int]:
    return {fmu.address_of("fmi3DoStep") for fmu in found}


def mapped(name: str) -> int:
    """How many libraries of this file name are in memory."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    return len({line.split()[4] for line in lines if name in line})


def counts(path: Path, out: Path) -> tuple[list[int], str]:
    """What three instances say about their number of steps, and the fingerprint of the run."""
    kind = FmuComponentType(path)
    components = {name: kind.create(name, {}) for name in ("a", "b", "c")}
    system = System(components, dict.fromkeys(components, STEP), [])
    recorder = Recorder(out)
    result = simulate(
        system, GaussSeidel(("a", "b", "c")), start=0, stop=STEPS * STEP, seed=0,
        observers=[recorder],
    )  # fmt: skip
    return [int(values["calls"]) for values in result.values.values()], recorder.fingerprint


def test_a_library_without_variables_is_in_memory_once(ends3: Path, tmp_path: Path) -> None:
    """In two files of the same bytes, too."""
    copy = tmp_path / "copy.fmu"
    shutil.copy(ends3, copy)
    with loaded(ends3, ends3, copy) as found:
        assert len(places(found)) == 1
        assert mapped("ends3.so") == 1
        assert len({fmu.resources for fmu in found}) == 3
    assert mapped("ends3.so") == 0


def test_a_library_with_a_counter_is_in_memory_for_each(counting3: Path, ends3: Path) -> None:
    with loaded(counting3, ends3, counting3) as found:
        assert len(places(found)) == 3
        assert mapped("ends3.so") == 3


def test_instances_do_not_disturb_each_other(
    counting3: Path, ends3: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each counts its own steps; it would count all of them in a library that were shared."""
    own = [STEPS] * 3
    alone, fingerprint = counts(counting3, tmp_path / "counting")
    assert alone == own
    assert counts(ends3, tmp_path / "shared") == (own, fingerprint)
    monkeypatch.setattr(sharing, "remembers_nothing", lambda _: False)
    assert counts(ends3, tmp_path / "copies") == (own, fingerprint)
    monkeypatch.setattr(sharing, "remembers_nothing", lambda _: True)
    assert counts(counting3, tmp_path / "wrong")[0] == [3 * STEPS - 2, 3 * STEPS - 1, 3 * STEPS]


def test_the_library_goes_with_its_last_instance(ends3: Path) -> None:
    """Whoever comes later shares it, even when the first one and its folder are gone."""
    others = dict(sharing.LIBRARIES._digests)
    with loaded(ends3, ends3) as found:
        assert sharing.LIBRARIES._digests != others
        (place,) = places(found)
        leave(found)
        found.append(LoadedFmu(read_description(ends3), "later"))
        assert places(found) == {place}
        assert found[0].call("fmi3Terminate", None) == 0
        leave(found)
        assert mapped("ends3.so") == 1
        assert found[0].call("fmi3Terminate", None) == 0
    assert mapped("ends3.so") == 0
    assert sharing.LIBRARIES._digests == others


def test_an_instance_that_is_left_alone_keeps_the_library(ends3: Path) -> None:
    """A dead instance is not unloaded; those that come later have nothing to do with it."""
    dead = LoadedFmu(read_description(ends3), "dead")
    dead.discard()
    with loaded(ends3, ends3) as found:
        assert len(places(found)) == 1
        assert places(found) != places([dead])
    assert dead.call("fmi3Terminate", None) == 0
    dead.unload()


def test_where_a_file_cannot_have_two_names_copies_stay(
    ends3: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr("os.link", refuse)
    with loaded(ends3, ends3) as found:
        assert len(places(found)) == 2


def test_a_file_that_is_gone_is_passed_over(tmp_path: Path, ends3: Path) -> None:
    """As those of the original process are, in a copy of it that lives on."""
    with loaded(ends3, ends3) as found:
        folder = found[1].resources.parent
        away = folder.rename(tmp_path / "away")
        found.append(LoadedFmu(read_description(ends3), "later"))
        assert len(places(found)) == 1
        away.rename(folder)


def test_the_garbage_collector_may_let_one_leave_while_another_enters(
    ends3: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That of which the new one was to be another name; what is left is another name of no file."""
    link = os.link
    with loaded(ends3) as found:

        def collecting(*names: Path) -> None:
            leave(found)
            link(*names)

        monkeypatch.setattr(os, "link", collecting)
        later: list[LoadedFmu] = []
        loader = threading.Thread(
            target=lambda: later.append(LoadedFmu(read_description(ends3), "later")), daemon=True
        )
        loader.start()
        loader.join(timeout=20)
        assert len(later) == 1  # else it waits for itself
        monkeypatch.setattr(os, "link", link)
        later.append(LoadedFmu(read_description(ends3), "last"))
        assert len(places(later)) == 1
        leave(later)
        leave(later)
