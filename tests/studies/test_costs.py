"""What experiments cost, from some of their runs."""

from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.campaign.work import Result, Work
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import Experiment
from studies import costs
from studies.costs import EXPERIMENTS, FILE, Cost, fitting, main, measured, page, read, spaced
from studies.method import records
from tests.studies.results import check_manual

STUDIES = Path(costs.__file__).parent


@pytest.fixture(scope="module")
def plan() -> Experiment:
    """Eight combinations, 300 seeds from 101 on."""
    return load_experiment(STUDIES / "collision" / "experiments" / "lasting_turning_relay.yaml")


@pytest.fixture
def performed(monkeypatch: pytest.MonkeyPatch) -> list[Work]:
    """What is run; the runs take 1, 2, 3, ... s of a processor."""
    done: list[Work] = []

    def perform(work: Work) -> Result:
        done.append(work)
        cpu = float(len(done))
        return Result(wall=99.0, fingerprint="0", metrics={}, error=None, cpu=cpu)

    monkeypatch.setattr("studies.costs.perform", perform)
    return done


@pytest.mark.parametrize(
    ("count", "wanted"),
    [(1, [0]), (2, [0, 7]), (3, [0, 4, 7]), (8, [*range(8)]), (20, [*range(8)])],
)
def test_combinations_are_spaced_from_the_first_to_the_last(
    plan: Experiment, count: int, wanted: list[int]
) -> None:
    assert spaced(plan, count) == wanted


def test_a_cost_is_of_processor_time_with_the_first_seed(
    plan: Experiment, performed: list[Work]
) -> None:
    """Runs of 1, 2 and 3 s: 8 times 300 of 2 s are 1.33 h on one core, 0.67 h on two."""
    found = measured(plan)
    assert (found.measured, found.cpu_least_s, found.cpu_s, found.cpu_most_s) == (3, 1.0, 2.0, 3.0)
    assert found.runs == 2400
    assert found.hours == pytest.approx(2 / 3)
    assert {work.overrides[-1] for work in performed} == {"seed=101"}
    last = plan.combinations[7].overrides
    assert performed[-1].overrides[:-1] == last


def test_a_run_that_fails_is_an_error(plan: Experiment, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = Result(wall=1.0, fingerprint=None, metrics={}, error="it broke", cpu=1.0)
    monkeypatch.setattr("studies.costs.perform", lambda _work: failed)
    with pytest.raises(ValueError, match=r"lasting_turning_relay.yaml: it broke"):
        measured(plan)


def cost(experiment: str, seconds: float) -> Cost:
    return Cost(
        experiment=experiment,
        combinations=6,
        seeds=100,
        measured=2,
        cpu_s=seconds,
        cpu_least_s=1.0,
        cpu_most_s=9.0,
        commit="abc",
        processor="fast",
    )


def test_the_page_has_all_experiments_and_their_sum(tmp_path: Path) -> None:
    """600 runs of 6 and 12 s are 0.5 and 1 h on two cores; what was not measured is said."""
    rows = [cost("relay_ahead", 6.0), cost("sharing_load", 12.0)]
    records.write(tmp_path / FILE, records.rows(rows))
    assert read(tmp_path) == rows
    text = page(tmp_path, "results")
    assert "| `make paper-readings` | relay_ahead | 2 | 6.0 (1.0 to 9.0) | 600 | 0.50 |" in text
    assert "| `make apmm` | sharing_load | 2 | 12.0 (1.0 to 9.0) | 600 | 1.00 |" in text
    assert "| `make apmm` | sharing_egos | 0 | - | - | - |" in text
    assert "| all |  | 4 |  | 1200 | 1.50 |" in text
    assert "different processors" not in text


def test_the_page_names_the_processors_if_there_are_several(tmp_path: Path) -> None:
    rows = [cost("relay_ahead", 6.0), cost("sharing_load", 12.0), cost("sharing_egos", 1.0)]
    rows[1], rows[2] = replace(rows[1], processor=""), replace(rows[2], processor="slow")
    records.write(tmp_path / FILE, records.rows([*rows, cost("relay_map_load", 1.0)]))
    text = page(tmp_path, "results")
    assert "so the sum is of none: fast (2), not noted (1), slow (1).\n" in text


def test_the_page_says_that_no_number_of_seeds_is_few_enough(tmp_path: Path) -> None:
    """600 runs of 120 s are 10 h on two cores, whatever those with 300 seeds take."""
    many = replace(cost("lasting_turning_relay", 1.0), seeds=300)
    records.write(tmp_path / FILE, records.rows([many, cost("relay_ahead", 120.0)]))
    text = page(tmp_path, "results")
    assert "10.2 h on 2 cores; more than 8 h without those that have 300 seeds.\n" in text


@pytest.mark.parametrize(
    ("seconds", "wanted"),
    [(24.0, None), (48.0, 150), (72.0, 100), (1e6, 0)],
)
def test_seeds_are_as_many_as_leave_all_within_eight_hours(
    seconds: float, wanted: int | None
) -> None:
    """Of 6 combinations with 300 seeds: runs of 24 s take 6 h. 2 h are of others."""
    many = replace(cost("many", seconds), seeds=300)
    others = cost("others", 24.0)
    assert others.hours == pytest.approx(2.0)
    assert fitting([many, others]) == wanted


def test_its_command_measures_what_is_named_and_keeps_the_rest(
    performed: list[Work], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One run to begin with, and two that count."""
    folder = tmp_path / "results"
    folder.mkdir()
    records.write(folder / FILE, records.rows([cost("sharing_load", 12.0)]))
    arguments = ["costs", str(tmp_path / "page.md"), str(folder), "lasting_turning_relay"]
    monkeypatch.setattr("sys.argv", [*arguments, "--runs", "2"])
    main()
    assert len(performed) == 3
    first, kept = read(folder)
    assert (first.experiment, first.cpu_s, first.measured) == ("lasting_turning_relay", 2.5, 2)
    assert kept == cost("sharing_load", 12.0)
    assert (tmp_path / "page.md").read_text() == page(folder, "results")


def test_its_command_names_what_there_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["costs", str(tmp_path / "page.md"), str(tmp_path), "relay"])
    with pytest.raises(SystemExit):
        main()
    assert "no experiment `relay`; there are: lasting_turning_" in capsys.readouterr().err


def test_all_experiments_of_the_makefile_are_there() -> None:
    for files in EXPERIMENTS.values():
        for file in files:
            assert (STUDIES / f"{file}.yaml").is_file()


def test_the_page_of_the_manual_is_that_of_the_results() -> None:
    check_manual("costs", lambda folder, link, _: page(folder, link), "study-costs.md")


def test_the_page_says_how_many_seeds_are_few_enough(tmp_path: Path) -> None:
    """Those of 300 seeds take 12 h of 6 combinations and 48 s, the others 2 h."""
    many = replace(cost("lasting_turning_relay", 48.0), seeds=300)
    records.write(tmp_path / FILE, records.rows([many, cost("relay_ahead", 24.0)]))
    text = page(tmp_path, "results")
    assert "take 14.0 h on 2 cores; with 150 seeds instead of 300 they take 8 h.\n" in text
