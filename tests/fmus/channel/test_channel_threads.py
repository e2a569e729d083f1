"""Threads find links; nobody can tell how many."""

import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from fmus.native.targets import zig_environment
from fmus.native.unit import SHELL, fmi_headers, load_unit
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene

from .harness import MS, Channel, packet
from .town import TOWN, WEAK, by_time, town

pytestmark = pytest.mark.slow

NEEDS_CHECKER: Final = pytest.mark.skipif(
    sys.platform != "linux", reason="the checker of threads needs Linux"
)
AMOUNTS: Final = (0, 1, 2, 17, 120)
"""Vehicles."""

STEP: Final = 10 * MS
STEPS: Final = 6

FMUS: Final = Path(__file__).parents[1]
NEEDS_FORK: Final = pytest.mark.skipif(
    not hasattr(os, "fork"), reason="this system cannot copy a process"
)


def crowd(cars: int, seed: int) -> Scene:
    """A town that is as dense for any number of cars, up to 120 of them within reach."""
    return town(seed, cars)


def announcements(scene: Scene, per_radio: int = 3) -> list[Array]:
    """Broadcasts of all radios of a scene, some of them strong or weak, and some routed."""
    rng = np.random.default_rng(5)
    radios = [v.id for v in scene.vehicles if v.equipped]
    records = []
    for number in range(per_radio * len(radios)):
        source = radios[number % len(radios)]
        time = int(rng.integers(0, STEPS * STEP))
        via = [radios[number % 7 % len(radios)]] if number % 4 == 0 else []
        via = [v for v in via if v != source]
        offset = float(rng.choice([0.0, 0.0, 6.0, -6.0]))
        records.append(packet(number, source, time=time, via=via, power_offset=offset))
    return by_time(records)


def life(channel: Channel, cars: int, *, first: int = 0, last: int = STEPS) -> list[bytes]:
    """The outputs of all steps; the scene changes in front of every second one."""
    records = announcements(crowd(cars, 0))
    found = []
    for k in range(first, last):
        if k % 2 == 0:
            channel.change(crowd(cars, k))
        begin, end = k * STEP, (k + 1) * STEP
        channel.step(begin / 1e9, STEP / 1e9, [r for r in records if begin <= int(r["time"]) < end])
        found += [channel.receptions(), channel.transmissions().tobytes()]
    return found


def lived(library: Library, cars: int, threads: int, **parameters: float) -> list[bytes]:
    """The outputs of a whole life with so many threads."""
    with Channel(library, crowd(cars, 0), threads=threads, **WEAK, **parameters) as channel:
        return life(channel, cars)


@pytest.mark.parametrize("cars", AMOUNTS)
@pytest.mark.parametrize(
    "parameters",
    [{}, {"weak_receptions": 0.0}, {"fading": 2.0, "interference_margin": 20.0}],
    ids=["all", "noticed", "fading"],
)
def test_equal_bytes_for_any_number_of_threads(
    library: Library, cars: int, parameters: dict[str, float]
) -> None:
    expected = lived(library, cars, 1, **parameters)
    assert (sum(map(len, expected)) > 5_000) == (cars >= 17)
    for threads in (2, 3, 8, 0):
        assert lived(library, cars, threads, **parameters) == expected


def test_two_instances_at_a_time(library: Library) -> None:
    expected = {cars: lived(library, cars, 1) for cars in (40, 120)}
    found: dict[int, list[list[bytes]]] = {cars: [] for cars in expected}

    def work(cars: int) -> None:
        for _ in range(5):
            found[cars].append(lived(library, cars, 3))

    both = [threading.Thread(target=work, args=(cars,)) for cars in expected]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    for cars, lives in found.items():
        assert lives == [expected[cars]] * 5


def test_a_state_goes_on_with_another_number_of_threads(library: Library) -> None:
    expected = lived(library, 60, 1)
    with Channel(library, crowd(60, 0), threads=3, **WEAK) as channel:
        life(channel, 60, last=2)
        state = channel.save()
    with Channel(library, TOWN, threads=2, **WEAK) as other:
        other.restore(state)
        assert life(other, 60, first=2) == expected[4:]


@NEEDS_FORK
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
@pytest.mark.parametrize("cut", [0, 2, 3])
def test_a_copy_of_the_process_goes_on_as_this_one_does(library: Library, cut: int) -> None:
    expected = lived(library, 120, 1)
    with Channel(library, crowd(120, 0), threads=3, **WEAK) as channel:
        life(channel, 120, last=cut)
        child = os.fork()
        if child == 0:
            same = life(channel, 120, first=cut) == expected[2 * cut :]
            channel.free()
            os._exit(not same)
        assert life(channel, 120, first=cut) == expected[2 * cut :]
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


THREADS: Final = Path("/proc/self/task")


@pytest.mark.skipif(not THREADS.is_dir(), reason="only Linux lists the threads of a process")
def test_threads_come_with_work_and_end_with_the_instance(library: Library) -> None:
    def count() -> int:
        return len(list(THREADS.iterdir()))

    before = count()
    with Channel(library, crowd(120, 0), threads=4, **WEAK) as channel:
        assert count() == before
        life(channel, 120)
        assert count() == before + 3
        channel.call("Reset")
        assert count() == before
    with Channel(library, TOWN, threads=4) as channel:
        channel.step(0.0, 0.01, [])
        assert count() == before


@pytest.mark.skipif(not THREADS.is_dir(), reason="only Linux lists the threads of a process")
@pytest.mark.parametrize(
    ("limit", "cars", "helps"), [("1", 120, False), (None, 20, False), (None, 120, True)]
)
def test_automatic_is_one_thread_in_small_scenes_and_where_the_environment_says_so(
    limit: str | None, cars: int, *, helps: bool
) -> None:
    code = (
        "import sys, tempfile; from pathlib import Path\n"
        "from tests.fmus.channel.test_channel_threads import *\n"
        "library = Library.build('channel', Path(tempfile.mkdtemp()))\n"
        f"with Channel(library, crowd({cars}, 0), **WEAK) as channel:\n"
        "    before = len(list(THREADS.iterdir()))\n"
        f"    records = announcements(crowd({cars}, 0), 1)\n"
        "    for r in records: r['time'] = 0\n"
        "    channel.step(0.0, 0.1, records)\n"
        "    sys.exit(len(list(THREADS.iterdir())) > before)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "NLOSIM_THREADS"}
    environment |= {} if limit is None else {"NLOSIM_THREADS": limit}
    if helps and len(os.sched_getaffinity(0)) < 2:  # type: ignore[attr-defined,unused-ignore]
        pytest.skip("one core only")
    done = subprocess.run([sys.executable, "-c", code], check=False, env=environment)
    assert done.returncode == helps


CHECKED: Final = ("-fsanitize=thread", "-fno-sanitize=undefined")


def compiled(folder: Path, driver: str, sources: Sequence[Path], *flags: str) -> Path:
    """A driver of the channel and the sources that it needs in one program."""
    unit, program = load_unit("channel"), folder / driver
    unit.write_generated(folder)
    headers = [folder, unit.folder, SHELL, FMUS / "native"]
    command = [sys.executable, "-m", "ziglang", "cc", "-std=c11", "-O1", "-g", "-mcpu=baseline"]
    command += [*flags, *(word for each in headers for word in ("-I", str(each)))]
    command += ["-isystem", str(fmi_headers()), *map(str, sources)]
    command += [str(FMUS / "channel" / "native" / f"{driver}.c"), "-lm", "-lpthread"]
    subprocess.run([*command, "-o", str(program)], check=True, env=zig_environment())
    return program


def check_races(*command: str | Path) -> None:
    """Nobody reads what another thread writes at that time."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    if "unexpected memory mapping" in done.stderr:
        pytest.skip("the checker of threads does not like this kernel")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""


def test_the_laws_of_a_team(tmp_path: Path) -> None:
    team = load_unit("channel").folder / "team.c"
    done = subprocess.run(
        [compiled(tmp_path, "teamwork", [team])],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith(" 0 broken\n")


@pytest.mark.slow
@NEEDS_CHECKER
def test_the_threads_of_a_team_do_not_race(tmp_path: Path) -> None:
    team = load_unit("channel").folder / "team.c"
    check_races(compiled(tmp_path, "teamwork", [team], *CHECKED), "apart")


@NEEDS_CHECKER
def test_nor_do_they_in_the_channel(tmp_path: Path) -> None:
    sources = load_unit("channel").sources()
    check_races(compiled(tmp_path, "busy", [*sources, tmp_path / "variables.c"], *CHECKED))


def test_links_found_at_once_or_when_they_are_asked_for_are_the_same(library: Library) -> None:
    scene = crowd(60, 0)
    records = announcements(scene)
    runs = set()
    for cuts in ([0.0, 0.06], [0.0, 0.0011, 0.02, 0.06], np.linspace(0.0, 0.06, 61)):
        for threads in (1, 4):
            received = b""
            with Channel(library, scene, threads=threads, **WEAK) as channel:
                for t, end in pairwise(map(float, cuts)):
                    begin, stop = round(t * 1e9), round(end * 1e9)
                    sent = [r for r in records if begin <= int(r["time"]) < stop]
                    received += channel.step(t, end - t, sent).tobytes()
            runs.add(received)
    assert len(runs) == 1
