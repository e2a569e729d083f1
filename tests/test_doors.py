"""The doors are open: every example of docs/adding-a-component.md works from a package of its own.

The package is made of the page as it stands, installed in a folder that is no part of nlosim, and
used by the commands of the page.
"""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.features import read_features
from fmus.messages.records import OUTCOMES, POINT, RECEPTION, SENSOR, frame, unframe
from orchestrator.recording import Recording
from orchestrator.testing import check_component
from tests.orchestrator.test_algorithm import order_of_convergence

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "adding-a-component.md").read_text()
MOST_LINES = 60


def files() -> dict[str, str]:
    """The files that the page shows, by the name in their first line."""
    found = {"pyproject.toml": re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]}
    for block in re.findall(r"```(?:python|c|yaml)\n(.*?)```", PAGE, re.DOTALL):
        name = re.match(r"(?:#|/\*) (\S+\.\w+)", block)
        assert name is not None, block
        found[name[1]] = block
    return found


def commands() -> list[list[str]]:
    """The runs that the page shows, without `nlosim`."""
    shown = re.findall(r"^nlosim (run .*)$", PAGE, re.MULTILINE)
    return [re.findall(r'"[^"]*"|\S+', line) for line in shown]


@dataclass(frozen=True, slots=True)
class Package:
    """The package, installed.

    Attributes:
        source: the folder with its files.
        site: the folder in which it is installed.
    """

    source: Path
    site: Path

    def executed(
        self, *arguments: str | Path, cwd: Path = ROOT, fails_with: int = 0
    ) -> subprocess.CompletedProcess[str]:
        """A command with `--json`, in a process in which the package is installed."""
        command = [sys.executable, "-m", "orchestrator", *map(str, arguments), "--json"]
        done = subprocess.run(
            command,
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(self.site), str(ROOT)])},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == fails_with, done.stdout + done.stderr
        return done

    def nlosim(self, *arguments: str | Path, fails_with: int = 0) -> Any:
        """What a command says as JSON."""
        return json.loads(self.executed(*arguments, fails_with=fails_with).stdout)

    def run(self, command: str, out: Path, *changes: str) -> tuple[dict[str, Any], Recording]:
        """The metrics and the recording of the run that the page shows with `command` in it."""
        (shown,) = (each for each in commands() if command in each)
        arguments = [word.strip('"') for word in shown]
        unasked = () if "measures" in command else ("measures={}",)
        sets = [word for change in (*unasked, *changes) for word in ("--set", change)]
        answer = self.nlosim(*arguments, *sets, "--no-figure", "--out", out)
        return answer["metrics"], Recording(out)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Package:
    source = tmp_path_factory.mktemp("my-package")
    for name, text in files().items():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(text)
    for folder in (source / "my_package", source / "my_package" / "stopping"):
        (folder / "__init__.py").touch()
    unit = source / "my_package" / "stopping"
    build = ["-m", "orchestrator", "fmu", "build", str(unit), "--target", "host"]
    subprocess.run([sys.executable, *build], cwd=ROOT, check=True, capture_output=True)
    assert (unit / "stopping.fmu").is_file()
    site = tmp_path_factory.mktemp("site")
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    pip = [sys.executable, "-m", "pip", "install", *options, "--target", str(site), str(source)]
    done = subprocess.run(pip, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return Package(source, site)


@pytest.fixture
def imported(package: Package, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Any]]:
    """Gives a module of the package, in this process."""
    monkeypatch.syspath_prepend(str(package.site))

    def module(name: str) -> Any:
        return __import__(f"my_package.{name}", fromlist=["*"])

    yield module
    for name in [name for name in sys.modules if name.partition(".")[0] == "my_package"]:
        del sys.modules[name]


@pytest.mark.parametrize("name", sorted(files()))
def test_no_example_is_long(name: str) -> None:
    assert len(files()[name].splitlines()) <= MOST_LINES


def test_what_the_package_offers_is_found(package: Package) -> None:
    offered = package.nlosim("components")
    rows = [row for kind in ("components", "algorithms", "measures") for row in offered[kind]]
    ours = {row["name"]: row for row in rows if row["origin"].startswith("my_package")}
    listed = ("components", "algorithms", "fmus", "measures")
    assert set(ours) == set().union(*(offered_in(group) for group in listed))
    assert [row["error"] for row in ours.values()] == [None] * len(ours)


def offered_in(group: str) -> set[str]:
    """The names that the package offers in a group of entry points."""
    _, _, rest = files()["pyproject.toml"].partition(f'entry-points."orchestrator.{group}"]')
    return set(re.findall(r'^([\w-]+) = "my_package', rest.partition("\n[")[0], re.MULTILINE))


def test_the_table_of_doors_has_all_groups_and_the_package_one_of_each_that_the_page_shows() -> (
    None
):
    own = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    table = PAGE.partition("## All doors")[2]
    assert set(re.findall(r"`(orchestrator\.[a-z_]+)`[,| ]", table)) == set(own)
    for row in table.splitlines():
        if "[above](#" in row:
            assert offered_in(row.split("`")[1].partition(".")[2]), row


@pytest.mark.slow
def test_a_relay_policy_chooses_in_the_red_light(package: Package, tmp_path: Path) -> None:
    chosen = "components.relay.type=relay-nearest"
    metrics, recording = package.run(chosen, tmp_path / "run", "time.stop=10 s")
    assert metrics["relays"]
    assert set(metrics["relays"]) <= set(recording["relay.relay"].values.tolist())


@pytest.mark.slow
def test_a_channel_model_loses_frames_by_distance(package: Package, tmp_path: Path) -> None:
    chosen = "components.channel.type=channel-soft-disc"
    _, recording = package.run(chosen, tmp_path / "run", "time.stop=2 s")
    shares = []
    for low, high in ((0, 50), (80, 120), (170, 250)):
        received = [
            outcome == OUTCOMES.index("R")
            for outcome, distance in links(recording)
            if low <= distance < high
        ]
        assert len(received) > 100
        shares.append(np.mean(received))
    near, half, far = shares
    assert near > 0.8
    assert half == pytest.approx(0.5, abs=0.12)
    assert far < 0.2


def links(recording: Recording) -> Iterator[tuple[int, float]]:
    """The outcome of every reception, and the distance between the vehicles [m]."""
    receptions = recording["channel.receptions"]
    for t, sample in zip(receptions.times.tolist(), receptions, strict=True):
        ids = np.asarray(recording["traffic.vehicle.id"].at(t)).tolist()
        position = np.asarray(recording["traffic.vehicle.position"].at(t))
        place = dict(zip(ids, position, strict=True))
        for row in unframe("RCPT", bytes(sample), RECEPTION):
            ends = [place.get(int(row[end])) for end in ("transmitter", "receiver")]
            if ends[0] is not None and ends[1] is not None:
                yield int(row["outcome"]), float(np.linalg.norm(ends[0] - ends[1]))


@pytest.mark.slow
def test_a_coupling_algorithm_couples_the_red_light_and_is_of_the_order_that_the_page_says(
    package: Package, imported: Callable[[str], Any], tmp_path: Path
) -> None:
    chosen = "coupling.algorithm=alternating"
    _, recording = package.run(chosen, tmp_path / "run", "time.stop=500 ms")
    wanted = {"algorithm": "alternating", "backwards_first": True}
    assert recording.manifest["scenario"]["coupling"] == wanted
    alternating = imported("alternating").Alternating
    for backwards in (False, True):
        order = order_of_convergence(alternating(backwards_first=backwards), ratio=1)
        assert order == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_a_driving_policy_and_an_encoder_drive(package: Package, tmp_path: Path) -> None:
    chosen = "components.encoder.type=encoder-nearest"
    changes = ("time.stop=9 s", "recording.exclude=[lidar.points]")
    _, recording = package.run(chosen, tmp_path / "run", *changes)
    sent = [read_features(bytes(sample)) for sample in recording["encoder.features"]]
    assert max(map(len, sent)) > 0
    speed = recording["traffic.ego.speed"].values
    assert speed[-1] < speed[0]  # nobody has shared anything yet, or it would not have slowed down


def test_the_encoder_sends_what_the_policy_waits_for(imported: Callable[[str], Any]) -> None:
    policy, encoder = imported("cautious").Cautious(), imported("nearest_points").NearestPoints()
    for component in (policy, encoder):
        check_component(component, steps=3, h=100_000_000, seed=1)
        component.setup(0, np.random.default_rng(0))
    inputs = {name: connector.start_value() for name, connector in policy.connectors.items()}
    inputs |= {"ego.speed": np.array(4.0), "points": scan_of_a_wall(), "ego.id": np.array(1)}
    encoder.step(inputs, 0, 100_000_000)
    (sent,) = read_features(encoder.outputs()["features"])
    assert sent.vehicle == 2
    np.testing.assert_array_equal(sent.keypoints[:, 0], np.arange(3, 35))
    policy.step(inputs, 0, 100_000_000)
    assert policy.outputs()["command"].tolist() == [0.0, 0.0, 0.0]
    policy.step({**inputs, "received.features": encoder.outputs()["features"]}, 0, 100_000_000)
    assert policy.outputs()["command"].tolist() == [1.0, 0.0, 0.0]


def scan_of_a_wall() -> bytes:
    """Vehicle 2 sees 100 points ahead of it, each 1 m farther, and as many on the ground."""
    sensor, points = np.zeros(1, SENSOR), np.zeros(200, POINT)
    sensor["vehicle"], sensor["count"], sensor["position"] = 2, 200, (0.0, 0.0, 2.0)
    points["position"][:100, 0] = 3.0 + np.arange(100)
    points["position"][100:, 2] = -2.0
    return frame("LPTS", sensor, points.tobytes())


@pytest.mark.slow
def test_a_native_unit_is_coupled_to_the_traffic(package: Package, tmp_path: Path) -> None:
    scene = ROOT / "scenarios" / "assets" / "red_light" / "red_light.sumocfg"
    scenario = tmp_path / "stopping.yaml"
    scenario.write_text(files()["stopping.yaml"].replace("red_light.sumocfg", str(scene)))
    package.nlosim("run", scenario, "--out", tmp_path / "run")
    recording = Recording(tmp_path / "run")
    speed = np.linalg.norm(recording["traffic.vehicle.velocity"].values, axis=-1)
    assert speed.max() > 5
    found = recording["stopping.vehicle.stopping_distance"].values
    np.testing.assert_allclose(found, 0.5 * speed + speed**2 / 16, rtol=1e-12)


@pytest.mark.slow
def test_a_measure_counts_in_the_red_light(package: Package, tmp_path: Path) -> None:
    measure = '"measures={silence: {receiver: 0}}"'
    metrics, recording = package.run(measure, tmp_path / "run", "time.stop=2 s")
    found = metrics["measures"]["silence"]
    rows = np.concatenate(
        [unframe("RCPT", bytes(each), RECEPTION) for each in recording["channel.receptions"]]
    )
    times = sorted(
        int(row["time"]) for row in rows if row["receiver"] == 0 and OUTCOMES[row["outcome"]] == "R"
    )
    assert found["receptions"] == len(times) > 10
    longest = max(b - a for a, b in pairwise(times))
    assert found["longest_s"] == pytest.approx(longest / 1e9, rel=1e-12)


@pytest.mark.slow
def test_a_report_says_how_long_the_ego_stood(
    package: Package, imported: Callable[[str], Any], tmp_path: Path
) -> None:
    metrics, recording = package.run("report=standing", tmp_path / "run", "time.stop=1 s")
    assert metrics == {"standing_s": 0.0, "least_m_s": recording["traffic.ego.speed"].values.min()}
    report = imported("standing").Standing(below=100.0)  # all of it counts
    metrics = report.metrics(recording)
    assert metrics["standing_s"] == pytest.approx(1.0)
    assert report.summary(metrics, recording.manifest) == "stood for 1.00 s"
    report.figure(recording, metrics, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_report_of_an_experiment_ranks_levels(package: Package, tmp_path: Path) -> None:
    for name in ("beacons.yaml", "ranking.yaml"):
        (tmp_path / name).write_text(files()[name])
    out = tmp_path / "out"
    answer = package.nlosim("experiment", tmp_path / "ranking.yaml", "--out", out, "--workers", "1")
    long, short = answer["tables"]["ranking"]
    assert (long["interval"], short["interval"]) == ("long", "short")
    assert short["sent"] - long["sent"] == 45  # 50 and 5 of the gate; the others draw the same
    lines = (f"{each['interval']}: {each['sent']:g} (3 runs)\n" for each in (long, short))
    assert (out / "report" / "ranking.txt").read_text() == "".join(lines)


def test_a_report_of_an_experiment_refuses_what_it_does_not_know(
    package: Package, tmp_path: Path
) -> None:
    (tmp_path / "beacons.yaml").write_text(files()["beacons.yaml"])
    wrong = files()["ranking.yaml"].replace("metric: sent", "metric: snet")
    (tmp_path / "ranking.yaml").write_text(wrong)
    out = tmp_path / "out"
    answer = package.nlosim("experiment", tmp_path / "ranking.yaml", "--out", out, fails_with=2)
    (problem,) = answer["error"]["problems"]
    assert problem["message"].endswith("`metric`: write one of sent")
    assert (problem["line"], out.exists()) == (13, False)


def test_a_benchmark_has_a_row_for_each_case(package: Package) -> None:
    answer = package.nlosim("bench", "features", "--repeat", "1")
    assert [row["case"] for row in answer["rows"]] == ["8 keypoints", "32 keypoints"]
    assert all(row["ours"] > 0 and row["unit"] == "us" for row in answer["rows"])


@pytest.mark.slow
def test_a_transport_counts_and_changes_nothing(package: Package, tmp_path: Path) -> None:
    assert "nlosim run scenarios/red_light.yaml --transport counting" in PAGE
    sets = ("--set", "time.stop=300 ms", "--set", "measures={}", "--no-figure")
    prints, told = [], ""
    for name in ("in-process", "counting"):
        words = ("run", "red_light", *sets, "--out", tmp_path / name, "--transport", name)
        done = package.executed(*words)
        prints.append(json.loads(done.stdout)["fingerprint"])
        told = done.stderr
    assert prints[0] == prints[1]
    counted = dict(re.findall(r"^(\w+) was sent (\d+) bytes in \d+ commands$", told, re.MULTILINE))
    assert set(counted) == {"lidar", "perception", "relay", "traffic"}
    assert min(map(int, counted.values())) > 1000


def test_a_component_from_scratch_keeps_the_contract_and_relays(
    package: Package, imported: Callable[[str], Any], tmp_path: Path
) -> None:
    newest = imported("newest").Newest
    check_component(newest(newest.Parameters()), steps=5, h=100_000_000, seed=1)
    inputs = {
        "received.bsm.id": np.array([3, 5, 8]),
        "received.bsm.age": np.array([0.1, 0.05, 0.3]),
    }
    component = newest(newest.Parameters())
    component.setup(0, np.random.default_rng(0))
    component.step(inputs, 0, 100_000_000)
    assert component.outputs()["relay"] == 5


@pytest.mark.slow
def test_structured_parameters_reach_a_component(package: Package, tmp_path: Path) -> None:
    scenario = tmp_path / "beacons.yaml"
    scenario.write_text(files()["beacons.yaml"])
    package.nlosim("run", scenario, "--out", tmp_path / "all")
    *_, position = Recording(tmp_path / "all")["beacons.position"]
    assert np.asarray(position).tolist() == [50.0, 1000.0, 2000.0]
    *_, sent = Recording(tmp_path / "all")["beacons.sent"]
    gate, bridge, tower = np.asarray(sent).tolist()
    assert gate == 10  # one in 100 ms, from the start on
    assert 17 <= bridge <= 50
    assert 15 <= tower <= 25
    assert "nlosim run beacons.yaml --set components.beacons.parameters.beacons.gate=null" in PAGE
    gone = "components.beacons.parameters.beacons.gate=null"
    package.nlosim("run", scenario, "--set", gone, "--out", tmp_path / "fewer")
    *_, sent = Recording(tmp_path / "fewer")["beacons.sent"]
    assert np.asarray(sent).tolist() == [
        bridge,
        tower,
    ]  # the gate draws nothing: they draw as before
