"""`nlosim check`, `graph`, `components`, `report` and the command line itself."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from orchestrator.cli import main, parser as parser_module
from orchestrator.cli.failures import outcome_of
from orchestrator.cli.outcome import Outcome


def test_check_says_ok(scenario_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(scenario_file)]) == 0
    assert capsys.readouterr().out == (
        f"{scenario_file}: ok, 2 components, 2 connections\n"
        f"{scenario_file}:15:5: `base`: `process: on-request` takes effect with `nlosim run "
        "--transport local` (or `zenoh`); without it they run in the orchestrator's process\n"
    )
    assert main(["check", str(scenario_file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"problems": []}


def test_check_prints_every_problem(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario_file.write_text(
        scenario_file.read_text().replace("title", "titel").replace("count: 2", "count: 0")
    )
    assert main(["check", str(scenario_file)]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert [line.removeprefix(f"{scenario_file}:").split(": ")[0] for line in lines] == [
        "1:1",
        "2:1",
        "11:40",
    ]
    assert main(["check", str(scenario_file), "--json"]) == 2
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert problems[2] == {
        "file": str(scenario_file),
        "line": 11,
        "column": 40,
        "message": "components.car.parameters.count: must be at least 1, got 0",
    }


EXPERIMENT = """\
schema: 1
scenario: two.yaml
seeds: 3
set: {report: trace}
factors:
  pace:
    fast: {components.car.parameters.mode: fast}
    slow: {components.car.parameters.mode: slow}
metrics: {distance: distance_m}
"""


def experiment_file(beside: Path, text: str = EXPERIMENT) -> Path:
    path = beside.with_name("experiment.yaml")
    path.write_text(text)
    return path


def test_check_of_an_experiment(scenario_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = experiment_file(scenario_file)
    assert main(["check", str(path)]) == 0
    said = f"{path}: ok, an experiment, 2 combinations, 3 seeds, 6 runs\n"
    assert capsys.readouterr().out == said
    assert main(["check", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {"problems": [], "combinations": 2, "seeds": 3, "runs": 6}


def test_check_of_an_experiment_prints_every_problem(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = EXPERIMENT.replace("mode: fast", "mode: fats").replace("mode: slow", "count: 0")
    path = experiment_file(scenario_file, text)
    assert main(["check", str(path), "--json"]) == 2
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert [(p["file"], p["line"], p["column"]) for p in problems] == [
        (str(path), 7, 44),
        (str(path), 8, 45),
    ]
    assert problems[1]["message"].endswith("must be at least 1, got 0")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--set", "seed=3"], "an experiment takes no --set; write what all runs share"),
        (["--checkpoint", "1s"], "an experiment takes no --checkpoint"),
    ],
)
def test_check_of_an_experiment_takes_no_options_of_a_run(
    scenario_file: Path, options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(experiment_file(scenario_file)), *options]) == 2
    assert said in capsys.readouterr().err


def test_an_experiment_is_no_scenario(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says what it is, not all that it lacks."""
    path = experiment_file(scenario_file)
    assert main(["run", str(path)]) == 2
    what = "this is an experiment, not a scenario; `nlosim experiment` runs it, and "
    said = f"{path}:2:1: {what}`nlosim check` checks it\n"
    assert capsys.readouterr().err == said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("scenario: two.yaml\nseeds: 2\ncomponents: {}\n", "`scenario` is not a key here"),
        ("schema: 1\nseeds: 2\n", "`seeds` is not a key here; did you mean `seed`?"),
        ("scenario: two.yaml\n", "`scenario` is not a key here"),
        ("- scenario\n- seeds\n", "expected a mapping"),
    ],
)
def test_what_is_hardly_an_experiment_is_taken_for_a_scenario(
    scenario_file: Path, text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(experiment_file(scenario_file, text))]) == 2
    found = capsys.readouterr().out
    assert said in found
    assert "this is an experiment" not in found


def test_check_finds_connections_that_do_not_fit(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    connections = "connections=[{from: car.power, to: base.u}]"
    assert main(["check", str(scenario_file), "--set", connections]) == 2
    assert "units differ: dBm and m" in capsys.readouterr().out


@pytest.mark.parametrize("algorithm", ["algorithm=jacobi", "order=[car, base]"])
def test_check_names_an_algebraic_loop_that_is_left_unsolved(
    scenario_file: Path, capsys: pytest.CaptureFixture[str], algorithm: str
) -> None:
    """With its place; the scenario is right all the same. Without an order it is not."""
    feedback = "connections=[{from: car.vehicle, to: base.vehicle}, {from: base.y, to: base.u}]"
    check = ["check", str(scenario_file), "--set", feedback]
    assert main([*check, "--set", f"coupling.{algorithm}"]) == 0
    remark, verdict, _ = capsys.readouterr().out.strip().split("\n")
    assert "coupling: algebraic loop: `base.u` -> `base.y` -> `base.u`; not solved" in remark
    assert remark.endswith("(a remark)")
    assert verdict.endswith("ok, 2 components, 3 connections")
    assert main(check) == 2
    assert "or give Gauss-Seidel an explicit order" in capsys.readouterr().out


def test_check_of_a_file_that_does_not_exist(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(tmp_path / "no.yaml")]) == 2
    assert "no.yaml:1:1: cannot be read: there is no such file" in capsys.readouterr().out


def test_graph_is_text_and_drawing(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawing = tmp_path / "wiring.svg"
    feedback = "connections=[{from: car.vehicle, to: base.vehicle}, {from: base.y, to: base.u}]"
    arguments = ["graph", str(scenario_file), "--set", feedback, "--svg", str(drawing)]
    assert main([*arguments, "--set", "coupling.order=[car, base]"]) == 0
    assert capsys.readouterr().out == (
        "Two units: 0 s to 1 s, gauss-seidel\n\n"
        "components, in the order in which they step:\n"
        "  1  car   sender    every 50 ms   this process\n"
        "  2  base  receiver  every 100 ms  own process, if a transport is given\n\n"
        "connections, with the age of the values when a step of the target ends:\n"
        "  car -> base   0       vehicle.* (2)\n"
        "  base -> base  100 ms  y -> u\n\n"
        "direct feedthrough:\n"
        "  base: y depends on u, vehicle.x\n\n"
        "algebraic loops:\n"
        "  algebraic loop: `base.u` -> `base.y` -> `base.u`; not solved: a delay breaks it, so its "
        "signals agree at the start only; solve it with `algorithm: quasi-newton` or "
        "`fixed-point`\n\n"
        f"drawn in {drawing}\n"
    )
    root = ET.fromstring(drawing.read_text())  # noqa: S314 - our own file
    texts = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"Two units", "car", "base", "sender", "every 100 ms"} <= texts
    delayed = root.findall(".//{http://www.w3.org/2000/svg}path[@class='delayed']")
    assert len(delayed) == 1


def test_graph_as_json(scenario_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph", str(scenario_file), "--json"]) == 0
    graph = json.loads(capsys.readouterr().out)
    assert [component["name"] for component in graph["components"]] == ["car", "base"]
    (connection,) = graph["connections"]
    assert (connection["from"], connection["to"]) == ("car", "base")
    assert {"from": "vehicle.x", "to": "vehicle.x"} in connection["signals"]


def test_components_are_listed_and_described(
    sample_units: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["components"]) == 0
    assert "sender    Drives around." in capsys.readouterr().out
    assert main(["components", "sender"]) == 0
    text = capsys.readouterr().out
    assert "power    number          = 26 dBm  -40 .. 33  transmit power" in text
    assert "vehicle.x  output  float64[]  m" in text
    assert main(["components", "receiver"]) == 0
    assert "vehicle.y  input   float64[]  m" in capsys.readouterr().out  # whatever `gain` is
    assert main(["components", "carts"]) == 0
    assert "known once the parameters are (required: `names`)" in capsys.readouterr().out
    assert main(["components", "sender", "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["parameters"]["power"]["unit"] == "dBm"
    assert described["connectors"]["power"]["causality"] == "output"
    assert main(["components", "sendr"]) == 2
    assert "did you mean `sender`?" in capsys.readouterr().err


def test_a_report_is_made_again(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--out", str(out), "--set", "report=trace"]) == 0
    first = (out / "metrics.json").read_text()
    (out / "metrics.json").unlink()
    capsys.readouterr()
    assert main(["report", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["metrics"] == json.loads(first)
    assert (out / "metrics.json").read_text() == first
    assert main(["report", str(tmp_path)]) == 2
    assert "holds no recording" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "the following arguments are required: COMMAND"),
        (["chek"], "no command `chek`; did you mean `check`?"),
        (["fmu", "biuld"], "no action `biuld`; did you mean `build`?"),
        (["zzz"], "no command `zzz`; there are: bench, check, completion, "),
        (["run"], "the following arguments are required: SCENARIO"),
        (
            ["run", "a.yaml", "--seed", "one"],
            "argument --seed: expected a whole number from 0 on, got 'one'",
        ),
        (
            ["run", "a.yaml", "--seed", "-1"],
            "argument --seed: expected a whole number from 0 on, got '-1'",
        ),
        (
            ["run", "a.yaml", "--sed", "1"],
            "unrecognized arguments: --sed 1; did you mean `--seed`?",
        ),
        (["run", "a.yaml", "-q"], "unrecognized arguments: -q"),
        (["check", "a.yaml", "--sets=a.b=1"], "--sets=a.b=1; did you mean `--set`?"),
        (["scene", "show", "a.yaml", "--radios", "3"], "did you mean `--radius`?"),
    ],
)
def test_a_wrong_command_line_is_wrong_input(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert message in capsys.readouterr().err
    assert main([*arguments, "--json"]) == 2
    assert message in json.loads(capsys.readouterr().out)["error"]["message"]


def test_a_bug_is_reported_with_the_place_of_its_traceback(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise IndexError("the developers did not think of this")

    monkeypatch.setattr("orchestrator.cli.check.load_scenario", broken)
    assert main(["check", str(scenario_file), "--json"]) == 5
    captured = capsys.readouterr()
    assert "internal error: IndexError: the developers did not think of this" in captured.err
    assert "Traceback" not in captured.err
    log = Path(json.loads(captured.out)["error"]["log"])
    assert "in broken" in log.read_text()
    log.unlink()


def test_too_little_memory_is_no_bug(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def large(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("orchestrator.cli.check.load_scenario", large)
    assert main(["check", str(scenario_file)]) == 2
    assert capsys.readouterr().err == "error: there is not enough memory for this\n"


def test_what_libraries_print_does_not_spoil_the_json(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def noisy(*_: object) -> None:
        print("printed by Python")  # noqa: T201
        os.write(1, b"printed by C\n")
        raise KeyboardInterrupt

    monkeypatch.setattr("orchestrator.cli.check.load_scenario", noisy)
    assert main(["check", str(scenario_file), "--json"]) == 4
    captured = capfd.readouterr()
    assert json.loads(captured.out)["error"]["kind"] == "interrupted"
    assert "printed by Python" in captured.err
    assert "printed by C" in captured.err


def test_the_help_teaches_without_loading_what_only_runs_need() -> None:
    code = (
        "import sys; from orchestrator.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'matplotlib', 'libsumo', 'pydantic', 'yaml', 'zenoh', 'fmpy'}\n"
        "print('LOADED', sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert "nlosim run red_light --seed 3" in done.stdout
    assert "exit codes:" in done.stdout
    assert done.stdout.endswith("LOADED []\n")


@dataclass(frozen=True)
class Offered:
    """A command of a package, which notes that it was loaded."""

    name: str
    loaded: list[str]
    value: str = "somewhere"

    def load(self) -> Callable[[Any], None]:
        self.loaded.append(self.name)
        return lambda commands: commands.add_parser(self.name)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["run", "red_light"], []),
        (["two", "run"], ["two"]),
        (["three"], ["one", "two"]),
        (["--json", "run"], ["one", "two"]),
        ([], ["one", "two"]),
    ],
)
def test_commands_of_packages_are_loaded_where_they_may_be_meant(
    given: list[str], expected: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[str] = []
    offers = [Offered("two", loaded), Offered("one", loaded)]
    monkeypatch.setattr(parser_module, "entry_points", lambda group: offers)
    top = parser_module.parser(given)
    assert loaded == expected
    for name in expected:
        assert top.parse_args([name]).command == name


def _add_stranger(commands: Any) -> None:
    def execute(arguments: object) -> Outcome:
        raise IndexError(f"{type(arguments).__name__} is empty")

    commands.add_parser("stranger").set_defaults(execute=execute)


def test_a_command_of_a_package_that_fails_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its mistake is no bug of ours, whatever module its function is of."""
    offer = EntryPoint("stranger", f"{__name__}:_add_stranger", parser_module.COMMANDS)
    monkeypatch.setattr(EntryPoint, "load", lambda entry: _add_stranger)
    monkeypatch.setattr(parser_module, "entry_points", lambda group: [offer])
    assert main(["stranger"]) == 3
    error = capsys.readouterr().err
    said = f"error: the command `stranger` of `{__name__}` failed: IndexError: Namespace is empty"
    assert error.startswith(f"{said}\nraised at {__file__}:")
    log = Path(error.rpartition("traceback: ")[2].strip())
    assert "IndexError: Namespace is empty" in log.read_text()
    log.unlink()


@pytest.mark.parametrize(
    ("module", "code", "said"),
    [
        ("backports.zstd", 2, "error: the module `backports.zstd` is missing, which this version"),
        ("orchestrator.nothing", 5, "internal error: ModuleNotFoundError: "),
    ],
)
def test_an_installation_that_lacks_a_module_is_no_bug(module: str, code: int, said: str) -> None:
    outcome = outcome_of(ModuleNotFoundError("No module", name=module))
    assert outcome.exit_code == code
    assert outcome.text.startswith(said)
