"""SUMO where the libraries of its window are missing: stand-ins take their place."""

import signal
import subprocess
import sys
import textwrap
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from adapters.sumo.connection import start
from adapters.sumo.errors import SumoError
from adapters.sumo.headless import LIBRARIES, import_libsumo, libraries, with_stand_ins
from fmus.native.libraries import libraries as built_for
from fmus.native.targets import TARGETS, host_platform

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there are no stand-ins")

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "adapters" / "sumo" / "headless" / host_platform()
SCENE = "scenarios/assets/red_light/red_light.sumocfg"

HIDDEN = """\
import ctypes
load = ctypes.CDLL
def hidden(name, *rest, **more):
    if name in {names!r}:
        raise OSError(name)
    return load(name, *rest, **more)
ctypes.CDLL = hidden
"""
"""Hides libraries of this system from `missing`; the dynamic linker still would find them."""


def hiding(names: tuple[str, ...], program: str) -> "subprocess.CompletedProcess[str]":
    """What a program in Python does where these libraries are missing."""
    command = [sys.executable, "-c", HIDDEN.format(names=names) + textwrap.dedent(program)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


@pytest.fixture
def all_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a system with none of the libraries; what this one has is not asked again after it."""
    monkeypatch.setattr(libraries, "missing", lambda: tuple(LIBRARIES))
    monkeypatch.setattr(libraries, "_is_there", lambda name: "/" in name and Path(name).is_file())


@pytest.mark.parametrize("names", [tuple(LIBRARIES), ("libGL.so.1", "libatomic.so.1"), ()])
def test_libsumo_runs_with_stand_ins(names: tuple[str, ...]) -> None:
    """They have every name that libsumo refers to, and none of the system's is loaded for them."""
    done = hiding(
        names,
        f"""
        from adapters.sumo.connection import start
        from adapters.sumo.headless import stand_in
        connection = start("libsumo", ["--configuration-file", {SCENE!r}])
        for _ in range(20):
            connection.step()
        print(connection.modules.simulation.getTime(), *stand_in())
        print(*{{line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}})
        connection.close()
        """,
    )
    assert done.returncode == 0, done.stderr
    said, loaded = (line.split() for line in done.stdout.splitlines()[-2:])
    assert float(said[0]) > 0.0
    assert {*names} <= {*said[1:]} <= {*LIBRARIES}
    for name in LIBRARIES:
        places = {Path(path).parent for path in loaded if Path(path).name.startswith(name)}
        assert (FOLDER in places) == (name in said[1:])
        assert name not in said[1:] or places == {FOLDER}


def test_a_function_that_is_called_all_the_same_says_so() -> None:
    done = hiding(
        (),
        f"""
        ctypes.CDLL({str(FOLDER / "libX11.so.6")!r}).XOpenDisplay(None)
        print("it came back")
        """,
    )
    assert (done.returncode, done.stdout) == (-signal.SIGABRT, "")
    what = "libX11.so.6 is not installed, and SUMO calls `XOpenDisplay` of it"
    assert done.stderr == f"nlosim: {what}\n"


def test_what_the_system_has_is_not_missing() -> None:
    """Each is asked for in a process of its own, in which nothing else was loaded."""
    said = hiding((), "from adapters.sumo.headless.libraries import missing; print(*missing())")
    there = [name for name in LIBRARIES if not hiding((), f"load({name!r})").returncode]
    assert said.stdout.split() == [name for name in LIBRARIES if name not in there]


def test_a_library_that_is_there_has_no_stand_in() -> None:
    """Only names are asked for, so this one is whichever the system has."""
    assert "libc.so.6" not in LIBRARIES
    assert libraries._is_there("libc.so.6")
    assert not libraries._is_there("libno-such-thing.so.1")


@pytest.mark.usefixtures("all_missing")
def test_without_stand_ins_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(libraries, "_folder", lambda: tmp_path)
    monkeypatch.setitem(sys.modules, "libsumo", None)  # its import fails
    with pytest.raises(SumoError) as caught:
        import_libsumo()
    assert str(caught.value) == (
        "libsumo cannot be loaded: libX11.so.6, libXext.so.6, libXrender.so.1, libGL.so.1, "
        "libatomic.so.1 are not installed, nor what stands in for them; on Debian and Ubuntu "
        "`apt-get install libx11-6 libxext6 libxrender1 libgl1 libatomic1` does so, or reinstall "
        "nlosim"
    )


def test_what_else_is_wrong_with_libsumo_is_told_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "libsumo", None)
    with pytest.raises(ImportError, match="import of libsumo halted"):
        import_libsumo()


@pytest.mark.usefixtures("all_missing")
def test_a_program_of_sumo_finds_the_stand_ins_after_what_it_is_told() -> None:
    assert with_stand_ins({"A": "b"}) == {"A": "b", "LD_LIBRARY_PATH": str(FOLDER)}
    told = with_stand_ins({"LD_LIBRARY_PATH": "/mine"})
    assert told == {"LD_LIBRARY_PATH": f"/mine:{FOLDER}"}


def test_a_program_of_sumo_is_told_nothing_if_nothing_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(libraries, "missing", tuple)
    assert with_stand_ins({"LD_LIBRARY_PATH": "/mine"}) == {"LD_LIBRARY_PATH": "/mine"}


@pytest.mark.skipif(find_spec("sumo") is None, reason="eclipse-sumo is not installed")
@pytest.mark.usefixtures("all_missing")
def test_sumo_runs_with_stand_ins(monkeypatch: pytest.MonkeyPatch) -> None:
    """The program, over TraCI; the libraries that the dynamic linker gave it are those."""
    begun: list[subprocess.Popen[bytes]] = []
    popen = subprocess.Popen

    def noted(command: list[str], **more: Any) -> subprocess.Popen[bytes]:
        begun.append(popen(command, **more))
        return begun[-1]

    monkeypatch.setattr(subprocess, "Popen", noted)
    monkeypatch.chdir(ROOT)
    connection = start("sumo", ["--configuration-file", SCENE])
    try:
        connection.step()
        (process,) = begun
        maps = Path(f"/proc/{process.pid}/maps").read_text(encoding="utf-8")
    finally:
        connection.close()
    loaded = {Path(line.split()[-1]) for line in maps.splitlines() if ".so" in line}
    for name in ("libX11.so.6", "libXext.so.6", "libXrender.so.1", "libGL.so.1"):
        assert {path.parent for path in loaded if path.name.startswith(name)} == {FOLDER}


def test_there_is_a_stand_in_for_each_on_every_linux() -> None:
    for target in TARGETS:
        made = [library.path for library in built_for(target)][1:]
        expected = [FOLDER.parent / target.platform / name for name in LIBRARIES]
        assert made == (expected if target.platform.endswith("-linux") else [])
