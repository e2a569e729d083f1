"""`nlosim rerun`: a run is repeated from its manifest, and compared sample by sample."""

import hashlib
import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.manifest import distributions
from orchestrator.provenance import versions
from orchestrator.rerunning.repeat import RerunError, planned
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from tests.orchestrator.walking import BASE, MODULE, WALK

Command = Callable[..., dict[str, Any]]


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a scenario that reads a table and a module; it is not the working one."""
    folder = tmp_path / "study"
    (folder / "data").mkdir(parents=True)
    (folder / "walk_parts.py").write_text(MODULE)
    (folder / "data" / "width.txt").write_text("0.5\n")
    (folder / "base.yaml").write_text(BASE)
    (folder / "walk.yaml").write_text(WALK)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return folder


@pytest.fixture
def nlosim(capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs a command in this process; gives what it says as JSON, its exit code as `code`."""

    def command(*words: object) -> dict[str, Any]:
        capsys.readouterr()
        code = main([*map(str, words), "--json", "--quiet"])
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return {**found, "code": code}

    return command


@pytest.fixture
def run(study: Path, nlosim: Command, tmp_path: Path) -> Path:
    """The directory of a run, outside of the folder of its scenario."""
    out = tmp_path / "runs" / "walk"
    assert nlosim("run", study / "walk.yaml", "--seed", 3, "--out", out, "--no-figure")["code"] == 0
    return out


def manifest(run: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((run / "manifest.json").read_text())
    return found


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_run_comes_out_the_same_and_can_be_repeated_again(run: Path, nlosim: Command) -> None:
    found = nlosim("rerun", run)
    then = manifest(run)
    assert (found["code"], found["equal"], found["first_difference"]) == (0, True, None)
    assert found["fingerprint"] == found["fingerprint_then"] == then["fingerprint"]
    assert Path(found["out"]) == run.with_name("walk-rerun")
    now = manifest(run.with_name("walk-rerun"))
    assert now["rerun_of"] == {key: then[key] for key in ("created", "fingerprint")}
    same = (
        "scenario",
        "files",
        "scenario_files",
        "paths",
        "overrides",
        "scenario_file",
        "versions",
    )
    assert {key: now[key] for key in same} == {key: then[key] for key in same}
    assert nlosim("rerun", found["out"])["code"] == 0


def test_the_manifest_has_digests_of_the_whole_chain_and_says_where_paths_begin(
    run: Path, study: Path
) -> None:
    found = manifest(run)
    chain = ("walk.yaml", "base.yaml")
    assert found["scenario_files"] == {name: sha256(study / name) for name in chain}
    assert [
        (each["at"][-1], each["from"], each["path"], each["sha256"]) for each in found["paths"]
    ] == [
        (key, "scenario", name, sha256(study / name))
        for key, name in (("type", "walk_parts.py"), ("table", "data/width.txt"))
    ]
    assert found["options"] == {
        "transport": None,
        "figure": False,
        "page": False,
        "default_measures": True,
    }


def test_the_first_signal_element_and_time_that_differ_are_named(
    run: Path, study: Path, nlosim: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    (study / "weather").write_text("wind@7")
    found = nlosim("rerun", run)
    first = found["first_difference"]
    assert found["code"] == 1
    assert (first["signal"], first["element"], first["time_ns"]) == ("one.place", [2], 700_000_000)
    assert float(first["now"]) - float(first["then"]) == 8.0
    assert found["differing_signals"] == ["one.place"]
    assert main(["rerun", str(run), "--quiet"]) == 1
    assert f"`one.place[2]` at t = 0.7 s was {first['then']}, and is {first['now']}" in (
        capsys.readouterr().out
    )


def test_inputs_are_found_by_their_content_wherever_and_whatever_they_are_called(
    run: Path, study: Path, nlosim: Command, tmp_path: Path
) -> None:
    moved = study.rename(tmp_path / "moved")
    (moved / "data").rename(moved / "tables")
    (moved / "tables" / "width.txt").rename(moved / "tables" / "w.txt")
    (moved / "tables" / "other.txt").write_text("0.25\n")
    (moved / "walk_parts.py").rename(moved / "parts_of_walk.py")
    refused = nlosim("rerun", run)
    assert refused["code"] == 2
    assert refused["error"]["reasons"] == [
        "`walk_parts.py`, which `one` reads, is missing",
        "`data/width.txt`, which `one` reads, is missing",
        "`--inputs FOLDER` says where files are, if elsewhere",
    ]
    assert nlosim("rerun", run, "--inputs", moved)["code"] == 0
    (moved / "tables" / "w.txt").unlink()
    refused = nlosim("rerun", run, "--inputs", moved)
    assert refused["error"]["reasons"][0] == "`data/width.txt`, which `one` reads, is missing"


def test_inputs_of_another_content_are_named_and_taken_only_if_that_is_asked_for(
    run: Path, study: Path, nlosim: Command
) -> None:
    (study / "data" / "width.txt").write_text("0.25\n")
    refused = nlosim("rerun", run)
    other = "`data/width.txt`, which `one` reads, has another content"
    assert (refused["code"], refused["error"]["reasons"][0]) == (2, other)
    assert not run.with_name("walk-rerun").exists()
    found = nlosim("rerun", run, "--anyway")
    assert (found["code"], found["changed_inputs"]) == (1, [other])
    first = found["first_difference"]
    assert float(first["then"]) == 2 * float(first["now"])  # all steps have half the width


def test_a_private_run_says_nothing_of_the_machine_and_is_repeated_all_the_same(
    study: Path, nlosim: Command, tmp_path: Path
) -> None:
    out = tmp_path / "private"
    table = study / "data" / "width.txt"
    setting = f"components.one.parameters.table={table}"
    assert (
        nlosim("run", study / "walk.yaml", "--set", setting, "--private", "--out", out)["code"] == 0
    )
    said = manifest(out)
    assert said["private"] is True
    assert "host" not in said
    assert said["scenario_file"] == "walk.yaml"
    assert said["scenario"]["components"]["one"]["parameters"]["table"] == "data/width.txt"
    folders = (str(tmp_path), str(Path.home()), str(Path(__file__).parents[2]))
    for path in out.rglob("*"):
        content = path.read_bytes() if path.is_file() else b""
        assert not [each for each in folders if each.encode() in content], path
    host = json.dumps(socket.gethostname())
    assert host not in (out / "manifest.json").read_text()
    refused = nlosim("rerun", out)
    assert (refused["code"], len(refused["error"]["reasons"])) == (2, 3)
    found = nlosim("rerun", out, "--inputs", study)
    assert found["code"] == 0
    assert manifest(Path(found["out"]))["private"] is True


def test_an_error_of_a_private_run_names_no_folder(
    study: Path, nlosim: Command, tmp_path: Path
) -> None:
    (study / "walk_parts.py").write_text(
        MODULE.replace('ValueError("lost in a storm")', 'ValueError(f"no way at {HERE}/map")')
    )
    (study / "weather").write_text("storm@3")
    out = tmp_path / "private"
    assert nlosim("run", study / "walk.yaml", "--private", "--out", out)["code"] == 3
    assert "no way at map" in manifest(out)["error"].replace("study/", "")
    assert str(tmp_path) not in (out / "log.txt").read_text() + json.dumps(manifest(out))
    refused = nlosim("resume", out)
    assert refused["code"] == 2
    assert "was made with `--private`" in refused["error"]["message"]


def test_a_private_run_has_no_checkpoints(study: Path, nlosim: Command) -> None:
    refused = nlosim("run", study / "walk.yaml", "--private", "--checkpoint", "1s")
    assert refused["code"] == 2
    assert "leave --private or --checkpoint out" in refused["error"]["message"]


def test_a_run_that_was_resumed_is_repeated(study: Path, nlosim: Command, tmp_path: Path) -> None:
    out = tmp_path / "cut"
    (study / "weather").write_text("storm@12")
    words = ("run", study / "walk.yaml", "--checkpoint", "500ms", "--out", out, "--no-figure")
    assert nlosim(*words)["code"] == 3
    refused = nlosim("rerun", out)
    assert refused["code"] == 2
    assert (
        "did not come to its end (failed: component `one` at t = 1.1 s"
        in refused["error"]["message"]
    )
    (study / "weather").unlink()
    assert nlosim("resume", out)["resumed_at_s"] == 1.0
    assert nlosim("rerun", out)["code"] == 0


def test_an_fmu_that_the_command_line_named_is_found_by_its_content(
    fmu: Callable[[str], Path], study: Path, nlosim: Command, tmp_path: Path
) -> None:
    path = fmu("lag")
    (study / "lag.fmu").write_bytes(path.read_bytes())
    (study / "plant.yaml").write_text(
        "schema: 1\ntitle: A plant\ntime: {stop: 100 ms}\n"
        "components:\n  plant: {fmu: nowhere.fmu, step: 10 ms}\n"
    )
    out, setting = tmp_path / "plant", f"components.plant.fmu={study / 'lag.fmu'}"
    assert nlosim("run", study / "plant.yaml", "--set", setting, "--out", out)["code"] == 0
    (study / "lag.fmu").rename(tmp_path / "elsewhere" / "renamed.fmu")
    refused = nlosim("rerun", out)
    assert refused["error"]["reasons"][0] == "`lag.fmu`, which `plant` reads, is missing"
    assert nlosim("rerun", out, "--inputs", tmp_path / "elsewhere")["code"] == 0


def test_what_was_on_a_host_is_repeated_here_if_it_is_the_same_and_else_named(
    run: Path, study: Path, nlosim: Command
) -> None:
    known = manifest(run)
    files = {"walk_parts.py": sha256(study / "walk_parts.py")}
    known["hosts"] = {"one": {"host": "gpu", "nlosim": "0", "files": files}}
    known["scenario"]["components"]["one"]["host"] = "gpu"
    known["files"] = {}
    (run / "manifest.json").write_text(json.dumps(known))
    assert nlosim("rerun", run)["code"] == 0
    known["hosts"]["one"]["files"]["walk_parts.py"] = "0" * 64
    (run / "manifest.json").write_text(json.dumps(known))
    refused = nlosim("rerun", run)
    other = "`walk_parts.py` of `one`, which was on a host, has another content"
    assert (refused["code"], refused["error"]["reasons"][0]) == (2, other)
    known["scenario"]["components"]["one"] |= {"type": "not-here", "host": "gpu"}
    known["paths"] = []
    (run / "manifest.json").write_text(json.dumps(known))
    reason = nlosim("rerun", run)["error"]["reasons"][0]
    assert reason.startswith("`one` was on the host `gpu`, and cannot be here: no component type")


def test_what_cannot_be_repeated_is_refused_with_the_reason(
    run: Path, nlosim: Command, tmp_path: Path
) -> None:
    nothing = nlosim("rerun", tmp_path / "elsewhere")["error"]
    assert (nothing["exit_code"], "holds no run" in nothing["message"]) == (2, True)
    assert "there is no folder" in nlosim("rerun", run, "--inputs", "x")["error"]["message"]
    known = manifest(run)
    old = {key: value for key, value in known.items() if key != "paths"}
    (run / "manifest.json").write_text(json.dumps(old))
    assert "says nothing of `paths`" in nlosim("rerun", run)["error"]["message"]
    known["paths"][0]["at"] = ["components", "two", "type"]
    (run / "manifest.json").write_text(json.dumps(known))
    message = nlosim("rerun", run)["error"]["message"]
    assert message.endswith("is damaged: its scenario has no `components.two.type`")


def test_a_component_that_writes_elsewhere_is_not_let_do_it_again(
    study: Path, nlosim: Command, tmp_path: Path
) -> None:
    (study / "sink.yaml").write_text(
        "schema: 1\ntitle: A sink\ntime: {stop: 1 s}\ncomponents:\n"
        "  one: {type: walk_parts:Walk, step: 100 ms, parameters: {table: data/width.txt}}\n"
        "  sink: {type: table-sink, step: 100 ms, parameters: "
        f"{{folder: '{tmp_path / 'elsewhere'}', file: x.csv, columns: ['x [m]']}}}}\n"
        'connections: [{from: "one.place[0]", to: sink.x}]\n'
    )
    out = tmp_path / "sink"
    made = nlosim("run", study / "sink.yaml", "--out", out, "--no-figure")
    assert made["code"] == 0, made
    (reason,) = nlosim("rerun", out)["error"]["reasons"]
    assert reason.startswith("`sink` writes `")


def test_a_damaged_recording_cannot_tell_where_the_second_differs(
    run: Path, study: Path, nlosim: Command
) -> None:
    (study / "weather").write_text("wind@7")
    values = run / "signals" / "one" / "place.zst"
    values.write_bytes(values.read_bytes()[:-20])
    found = nlosim("rerun", run)
    assert (found["code"], found["first_difference"]) == (1, None)
    assert str(values) in found["faults"][0]


def test_versions_are_of_what_takes_part_and_of_what_that_requires() -> None:
    found = versions(distributions(load_scenario(scenario_path("red_light")), "local"))
    assert {"nlosim", "python", "libsumo", "numpy", "pydantic-core", "pillow"} <= set(found)
    assert not {"pytest", "mypy", "ruff", "mkdocs"} & set(found)
    assert "pytest" in versions(["pytest"])
    assert {"pluggy", "iniconfig"} <= set(versions(["pytest"]))


def test_another_version_is_told_and_does_not_hinder(run: Path, nlosim: Command) -> None:
    known = manifest(run)
    known["versions"] |= {"numpy": "1.0", "gone": "3"}
    (run / "manifest.json").write_text(json.dumps(known))
    found = nlosim("rerun", run)
    assert found["code"] == 0
    assert found["changed_versions"][0].endswith(", and was 1.0")
    assert found["changed_versions"][1] == "gone is not installed, and was 3"


def test_what_is_missing_and_what_is_another_are_named_at_once(
    run: Path, study: Path, nlosim: Command
) -> None:
    (study / "data" / "width.txt").write_text("0.25\n")
    with pytest.raises(RerunError):
        planned(run)
    hint = "`--anyway` repeats it with what is here"
    assert nlosim("rerun", run)["error"]["reasons"][1:] == [hint]
    (study / "walk_parts.py").unlink()
    assert nlosim("rerun", run)["error"]["reasons"] == [
        "`walk_parts.py`, which `one` reads, is missing",
        "`data/width.txt`, which `one` reads, has another content",
        "`--inputs FOLDER` says where files are, if elsewhere",
    ]


def test_the_new_run_is_where_it_was_asked_for_and_steps_as_the_first_one_did(
    study: Path, nlosim: Command, tmp_path: Path
) -> None:
    then, now = tmp_path / "then", tmp_path / "now"
    marked = ("--set", "components.one.process=on-request")
    words = ("run", study / "walk.yaml", *marked, "--transport", "loopback", "--out", then)
    assert nlosim(*words)["code"] == 0
    assert nlosim("rerun", then, "--out", now)["out"] == str(now)
    assert manifest(now)["transport"] == manifest(then)["transport"] == "loopback"
    assert not [each.name for each in now.glob("*") if each.suffix in {".png", ".svg", ".html"}]
    assert (then / "index.html").exists()
    other = nlosim("rerun", then, "--transport", "in-process")
    assert (other["code"], manifest(Path(other["out"]))["transport"]) == (0, "in-process")


def test_files_that_measures_read_are_inputs_too(
    study: Path, nlosim: Command, tmp_path: Path
) -> None:
    (study / "reference.csv").write_text("time,y\n0,0\n2,20\n")
    (study / "walk.yaml").write_text(
        f"{WALK}measures:\n  close: {{type: signal, signal: one.steps, "
        "statistic: maximum-error, column: y, reference: reference.csv}\n"
    )
    out = tmp_path / "out"
    made = nlosim("run", study / "walk.yaml", "--out", out, "--no-figure")
    assert made["code"] == 0, made
    said = manifest(out)
    assert said["files"]["measures.close"] == {"reference.csv": sha256(study / "reference.csv")}
    assert said["paths"][-1]["at"] == ["measures", "close", "reference"]
    assert nlosim("rerun", out, "--inputs", study.rename(tmp_path / "moved"))["code"] == 0
