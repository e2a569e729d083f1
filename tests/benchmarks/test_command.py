import json
from importlib.metadata import EntryPoint
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

from benchmarks import offers
from orchestrator.cli import main, parser
from tests.benchmarks import fakes
from tests.benchmarks.schema import ONE, SEVERAL


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Install `bench` and the given benchmarks, and no others."""

    def do(*benchmarks: tuple[str, str]) -> None:
        commands = [EntryPoint("bench", "benchmarks.command:add_command", parser.COMMANDS)]
        offered = [
            EntryPoint(name, f"tests.benchmarks.fakes:{value}", offers.BENCHMARKS)
            for name, value in benchmarks
        ]
        monkeypatch.setattr(parser, "entry_points", lambda group: commands)
        monkeypatch.setattr(offers, "entry_points", lambda group: offered)

    return do


@pytest.mark.slow
def test_one_benchmark_as_json(install: Any, capsys: pytest.CaptureFixture[str]) -> None:
    install(("count", "CountingBenchmark"), ("other", "CountingBenchmark"))
    assert main(["bench", "count", "--repeat", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, ONE)
    assert (found["name"], found["repetitions"], found["complete"]) == ("count", 3, True)
    one, two = found["rows"]
    assert (one["ours"], one["low"], one["high"]) == (2, 1, 3)
    assert (one["peer"], one["peer_name"], one["ratio"]) == (0.5, "sloth", 4)
    assert (two["peer"], two["peer_name"], two["ratio"]) == (None, None, None)


def test_a_setting_reaches_the_benchmark_and_its_result(
    install: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    install(("named", "NamedBenchmark"))
    assert main(["bench", "named", "--set", "name=a=b", "--repeat", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, ONE)
    assert found["settings"] == {"name": "a=b"}
    assert [row["case"] for row in found["rows"]] == ["a=b"]


def test_without_a_name_all_benchmarks_run(
    install: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    install(("b", "CountingBenchmark"), ("a", "CountingBenchmark"))
    assert main(["bench", "--repeat", "1", "--case", "one", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, SEVERAL)
    assert [each["name"] for each in found["benchmarks"]] == ["a", "b"]
    assert [[row["case"] for row in each["rows"]] for each in found["benchmarks"]] == [["one"]] * 2


def test_what_is_missing_is_noticed_before_anything_is_measured(
    install: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    install(("count", "CountingBenchmark"), ("needy", "NeedyBenchmark"))
    monkeypatch.setattr(fakes.CountedCase, "measure", lambda _: pytest.fail("measured"))
    assert main(["bench"]) == 2
    assert "there is no sloth" in capsys.readouterr().err


@pytest.mark.slow
def test_people_read_a_table(install: Any, capsys: pytest.CaptureFixture[str]) -> None:
    install(("count", "CountingBenchmark"))
    assert main(["bench", "--repeat", "3"]) == 0
    text = capsys.readouterr().out
    assert "count: counts\n" in text
    assert "  one      2       (1 .. 3)  1     0.5 (sloth)      4     3\n" in text
    assert "a sloth\n" in text
    assert "machine: " in text


def test_benchmarks_are_listed(install: Any, capsys: pytest.CaptureFixture[str]) -> None:
    install(("count", "CountingBenchmark"))
    assert main(["bench", "--list"]) == 0
    assert capsys.readouterr().out == "count: counts\n"
    install()
    assert main(["bench", "--list"]) == 0
    assert capsys.readouterr().out == "no benchmarks are installed\n"


@pytest.mark.slow
def test_an_interrupted_benchmark_says_so_and_prints_what_it_has(
    install: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    install(("slow", "InterruptedBenchmark"), ("zz-not-reached", "CountingBenchmark"))
    assert main(["bench", "--json"]) == 4
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, SEVERAL)
    (slow,) = found["benchmarks"]
    assert not slow["complete"]
    assert [row["details"]["runs"] for row in slow["rows"]] == [2, 1]
    assert found["error"] == {
        "kind": "interrupted",
        "exit_code": 4,
        "message": "interrupted",
    }
    assert main(["bench", "slow"]) == 4
    text = capsys.readouterr().err
    assert text.endswith("interrupted: these are the cases measured until then\n")
    assert "(1 .. 2)" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["cuont"], "there is no benchmark `cuont`; did you mean `count`?"),
        (["count", "--case", "ons"], "no case matches `ons`; did you mean `one`?"),
        (["count", "--repeat", "0"], "must be a whole number from 1 on, got '0'"),
        (["count", "--repeat", "few"], "must be a whole number from 1 on, got 'few'"),
        (["broken"], "benchmark `broken`: `tests.benchmarks.fakes:no_benchmark` makes no `Bench"),
        (["named", "--set", "nmae=a"], "`named` has no setting `nmae`; did you mean `name`?"),
        (
            ["count", "--set", "name=a"],
            "the benchmark `count` has no setting `name`; there are none",
        ),
        (["named", "--set", "name"], "`--set name` is no NAME=VALUE"),
        (["--set", "name=a"], "`--set` changes a setting of one benchmark: give its name, too"),
        (["missing"], "cannot load the benchmark `missing` from `tests.benchmarks.fakes:nobody`"),
        (["twice"], "is offered several times"),
    ],
)
def test_wrong_input_has_a_message_and_exit_code_2(
    arguments: list[str], message: str, install: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    offered = [("count", "CountingBenchmark"), ("named", "NamedBenchmark")]
    if "--set" not in arguments:
        offered += [("broken", "no_benchmark"), ("missing", "nobody")]
    twice = [("twice", "CountingBenchmark"), ("twice", "InterruptedBenchmark")]
    install(*offered, *(twice if arguments == ["twice"] else []))
    assert main(["bench", *arguments]) == 2
    assert message in capsys.readouterr().err
