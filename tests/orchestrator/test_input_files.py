"""Input files: the manifest has their digests, and what is wrong with them is said before a run."""

import hashlib
import importlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from adapters.fmi import FmuComponentType
from orchestrator import registry
from orchestrator.cli import main
from orchestrator.input_files import named_files
from tests.installation import install

READING = """\
schema: 1
title: Two readers
time: {start: 0 s, stop: 1 s}
coupling: {algorithm: gauss-seidel}
components:
  left:
    type: reader
    step: 100 ms
    parameters: {list: a.txt}
  right:
    type: reader
    step: 100 ms
    parameters: {list: sub/b.txt}
"""


@pytest.fixture
def reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario whose components read files that name files."""
    monkeypatch.syspath_prepend(Path(__file__).parent / "packages")
    install(monkeypatch, {registry.COMPONENTS: {"reader": "reading_units:Reader"}})
    checks().clear()
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.txt").write_text("sub/c.txt\n")
    (tmp_path / "sub" / "b.txt").write_text("c.txt\n")
    (tmp_path / "sub" / "c.txt").write_text("3\n")
    path = tmp_path / "reading.yaml"
    path.write_text(READING)
    return path


def checks() -> list[bool]:
    """For each check of a component, whether it was to be thorough."""
    made: list[bool] = importlib.import_module("reading_units").CHECKS
    return made


def manifest_of(scenario: Path, out: Path) -> dict[str, Any]:
    assert main(["run", str(scenario), "--out", str(out), "--quiet"]) == 0
    content: dict[str, Any] = json.loads((out / "manifest.json").read_text())
    return content


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_manifest_has_the_digest_of_every_file_that_a_component_reads(
    reading: Path, tmp_path: Path
) -> None:
    c = sha256(tmp_path / "sub" / "c.txt")
    assert manifest_of(reading, tmp_path / "out")["files"] == {
        "left": {"a.txt": sha256(tmp_path / "a.txt"), "sub/c.txt": c},
        "right": {"sub/b.txt": sha256(tmp_path / "sub" / "b.txt"), "sub/c.txt": c},
    }


def test_files_elsewhere_have_absolute_paths_and_folders_no_digest(
    reading: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "d.txt"
    elsewhere.write_text("\n")
    reading.write_text(READING.replace("a.txt", str(elsewhere)).replace("sub/b.txt", "sub"))
    files = manifest_of(reading, tmp_path / "out")["files"]
    assert files == {"left": {elsewhere.as_posix(): sha256(elsewhere)}}


def test_a_path_needs_no_capability_to_have_a_digest(scenario_file: Path, tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_text("1,2\n")
    scenario_file.write_text(
        scenario_file.read_text().replace("noisy: true", "noisy: true, trace: trace.csv")
    )
    files = manifest_of(scenario_file, tmp_path / "out")["files"]
    assert files == {"car": {"trace.csv": sha256(tmp_path / "trace.csv")}}


def test_an_fmu_has_a_digest(fmu: Callable[[str], Path]) -> None:
    path = fmu("lag")
    assert FmuComponentType(path).input_files({}) == (path,)


def test_paths_are_found_at_any_depth(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Record:
        file: Path | None
        more: tuple[Path, ...]

    files = [tmp_path / name for name in "abc"]
    for file in files:
        file.touch()
    values = {"r": (Record(files[0], (files[1], tmp_path)), Record(None, ())), "x": files[2]}
    assert list(named_files(values)) == files


@pytest.mark.parametrize(("command", "thorough"), [("check", True), ("run", False)])
def test_every_problem_ends_the_command_before_anything_is_made(
    command: str,
    *,
    thorough: bool,
    reading: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "a.txt").write_text("sub/c.txt\nno.txt\n")
    (tmp_path / "sub" / "b.txt").write_text("\n\nnone.txt\n")
    monkeypatch.chdir(tmp_path)
    assert main([command, str(reading)]) == 2
    captured = capsys.readouterr()
    assert f"{tmp_path / 'a.txt'}:2:1: there is no `no.txt`" in captured.out + captured.err
    assert f"{tmp_path / 'sub/b.txt'}:3:1: there is no `none.txt`" in captured.out + captured.err
    assert not (tmp_path / "runs").exists()
    assert checks() == [thorough, thorough]


def test_problems_of_files_and_of_connections_are_said_together(
    reading: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").write_text("no.txt\n")
    reading.write_text(READING + "connections:\n  - {from: left.u, to: right.u}\n")
    assert main(["check", str(reading)]) == 2
    text = capsys.readouterr().out
    assert "a.txt:1:1: there is no `no.txt`" in text
    assert f"{reading}:15:5: connections[0]" in text


def test_a_problem_with_a_parameter_is_placed_in_the_scenario(
    reading: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").write_text("")
    assert main(["check", str(reading)]) == 2
    where = f"{reading}:9:24: components.left.parameters.list"
    assert capsys.readouterr().out == f"{where}: the list is empty\n"


def test_remarks_do_not_end_a_run_and_are_logged(
    reading: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").write_text("sub/c.txt\nsub/c.txt\n")
    remark = f"{tmp_path / 'a.txt'}:2:1: `sub/c.txt` is named twice"
    assert main(["check", str(reading)]) == 0
    assert capsys.readouterr().out.startswith(f"{remark} (a remark)\n")
    manifest_of(reading, tmp_path / "out")
    assert remark in (tmp_path / "out" / "log.txt").read_text()


def test_a_check_that_fails_is_said_of_the_component(
    reading: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def check_files(*_: object, **__: object) -> None:
        raise KeyError("out of order")

    reader = importlib.import_module("reading_units").Reader
    monkeypatch.setattr(reader, "check_files", check_files)
    assert main(["check", str(reading)]) == 3
    assert "component `left`: cannot check its files: KeyError" in capsys.readouterr().err


def test_parameters_that_a_type_refuses_are_said_once(
    reading: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reading.write_text(READING.replace("list: a.txt", "list: a.txt, first: 9, last: 3"))
    assert main(["check", str(reading)]) == 2
    assert capsys.readouterr().out == (
        f"{reading}:9:31: components.left: `first` is after `last`\n"
    )
