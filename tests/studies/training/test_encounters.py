"""Several encounters: who is driven when, variants that are held out, and runs that are shared."""

import csv
import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator.campaign.conduct import Interrupted
from orchestrator.campaign.work import Work
from orchestrator.errors import ScenarioError
from orchestrator.intervals import share
from studies.training.collection import Collection
from studies.training.encounters import Encounter, overlap, turn
from studies.training.load import load_training
from studies.training.several import conduct_several, spread
from tests.studies.training.conftest import Laboratory

SEVERAL = """\
schema: 1
seed: 7
network: {type: toy-learner}
set: {components.policy.parameters.silent: false}
encounters:
  breeze:
    scenario: ball.yaml
    weight: 2
    scenes:
      wind:
        calm: {components.policy.parameters.wind: 0.1}
        gust: {components.policy.parameters.wind: 0.5}
      start:
        left: {components.policy.parameters.start: -2}
        right: {components.policy.parameters.start: 2}
  storm:
    scenario: ball.yaml
    set: {components.policy.parameters.wind: 1.0}
held_out:
  far:
    encounter: breeze
    set: {components.policy.parameters.start: 9}
expert: {runs: 6, seed: 3}
dagger: {rounds: 1, runs: 3, beta: 0.5, decay: 0.5}
validation: {runs: 3, drives: 3}
evaluation: {runs: 4}
optimisation: {epochs: 6, batch: 8, rate: 0.05, patience: 2}
device: cpu
checkpoint: toy.safetensors
"""


DRIVE = """\
schema: 1
title: A speed goes by
time: {stop: 1 s}
components:
  drive: {type: table-source, step: 1 s, parameters: {file: drive.csv}}
"""


@pytest.fixture
def several(laboratory: Laboratory) -> Laboratory:
    laboratory.file.write_text(SEVERAL)
    return laboratory


def settings(work: Work) -> dict[str, Any]:
    """What the run's overrides set, by the last key of the path; the last one counts."""
    pairs = (text.split("=", 1) for text in work.overrides)
    return {path.rsplit(".", 1)[-1]: json.loads(value) for path, value in pairs}


def phases(laboratory: Laboratory) -> Iterator[tuple[str, dict[str, Any]]]:
    for work in laboratory.workers.done:
        assert work.keep is not None
        yield Path(work.keep).parent.name.rsplit("-", 1)[0], settings(work)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def problems(laboratory: Laboratory) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        load_training(laboratory.file)
    return [str(each).replace(f"{laboratory.folder}/", "") for each in error.value.problems]


def test_encounters_take_turns_by_their_weights() -> None:
    first, second = (
        Encounter(name=name, scenario=Path("x"), weight=weight, settings={}, scenes={})
        for name, weight in (("a", 3), ("b", 2))
    )
    for begin in (0, 11, 10**9):
        found = Counter(turn((first, second), seed).name for seed in range(begin, begin + 50))
        assert found == {"a": 30, "b": 20}


def test_what_is_driven(several: Laboratory) -> None:
    """Everybody in turn; the far start only at the end, as often as every encounter."""
    found = several.train()
    seen = [*phases(several)]
    count = Counter(name for name, _ in seen)
    last = found.findings.chosen
    evaluated = {f"evaluation-{last}-{place}": 4 for place in ("breeze", "storm", "far")}
    far = f"evaluation-{last}-far"
    drives = {"drive-0": 3, "drive-1": 3}
    assert count == {"validation": 3, "expert": 6, "dagger-1": 3, **drives, **evaluated}
    for name in ("expert", "validation", "dagger-1", "drive-1"):
        storms = [each["wind"] == 1.0 for phase, each in seen if phase == name]
        assert sum(storms) == len(storms) // 3, name
    for name, each in seen:
        assert (each.get("start") == 9) == (name == far)
        assert each["silent"] is False
    seeds = {n: [e["seed"] for phase, e in seen if phase == n] for n in evaluated}
    assert len({tuple(each) for each in seeds.values()}) == 1
    others = {each["seed"] for name, each in seen if name not in evaluated}
    assert not others & set(seeds[far])
    assert [r["encounter"] for r in found.findings.evaluation] == ["breeze", "storm", "far"]
    assert [r["held_out"] for r in found.findings.evaluation] == [False, False, True]


def test_the_table_of_the_evaluation(several: Laboratory) -> None:
    """Shares with Wilson's intervals, of the network that was chosen."""
    found = several.train()
    (far,) = (r for r in rows(several.folder / "out" / "evaluation.csv") if r["encounter"] == "far")
    expected = share([False] * 4)
    assert (far["runs"], far["failed"], far["held_out"]) == ("4", "0", "True")
    assert far["driver"] == f"round {found.findings.chosen}"
    if float(far["collision"]) == 0.0:
        assert float(far["collision_high"]) == pytest.approx(expected.high)
    assert "evaluation" in found.summary


def test_runs_say_which_encounter_they_are_of(several: Laboratory) -> None:
    training = load_training(several.file)
    phase = training.lessons(0)
    names = [training.scene(phase, seed)["encounter"] for seed in phase.seeds]
    assert Counter(names) == {"breeze": 4, "storm": 2}
    (far,) = (e for e in training.evaluation(0) if e.name == "evaluation-0-far")
    assert training.scene(far, 1).keys() == {"encounter", "wind"}


def test_an_evaluation_may_grow_and_goes_on(several: Laboratory) -> None:
    last = several.train().findings.chosen
    several.workers.done.clear()
    several.change("evaluation: {runs: 4}", "evaluation: {runs: 5}")
    assert [r["runs"] for r in several.train(resume=True).findings.evaluation] == [5, 5, 5]
    assert [name for name, _ in phases(several)] == [
        f"evaluation-{last}-breeze",
        f"evaluation-{last}-storm",
        f"evaluation-{last}-far",
    ]


def test_another_network_is_evaluated_anew(several: Laboratory) -> None:
    """With a round more another one is chosen, of which the former runs say nothing."""
    before = several.train().findings.chosen
    several.workers.done.clear()
    several.change("rounds: 1", "rounds: 2")
    found = several.train(resume=True).findings
    assert found.chosen not in {None, before}
    driven = Counter(name for name, _ in phases(several) if name.startswith("evaluation"))
    places = ("breeze", "storm", "far")
    assert driven == {f"evaluation-{found.chosen}-{place}": 4 for place in places}
    assert {row["driver"] for row in found.evaluation} == {f"round {found.chosen}"}


def test_an_encounter_without_weight_is_held_out(several: Laboratory) -> None:
    """It is driven at the end only, and variants of others may be among its scenes."""
    several.change("storm:\n", "storm:\n    weight: 0\n")
    several.change("start: 9}", "wind: 1}")
    found = several.train()
    assert [r["held_out"] for r in found.findings.evaluation] == [False, True, True]
    winds: dict[str, set[float]] = {}
    for name, each in phases(several):
        winds.setdefault(name, set()).add(each["wind"])
    assert winds.pop(f"evaluation-{found.findings.chosen}-far") == {1.0}
    assert winds.pop(f"evaluation-{found.findings.chosen}-storm") == {1.0}
    assert not any(1.0 in each for each in winds.values())


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "start: 9}",
            "start: -2}",
            "22:10: held_out.far.set: is learned from: the encounter `breeze` has all of these",
        ),
        (
            "encounter: breeze\n    set: {components.policy.parameters.start: 9}",
            "encounter: storm\n    set: {components.policy.parameters.wind: 1}",
            "22:10: held_out.far.set: is learned from: the encounter `storm` has all of these",
        ),
        (
            "encounter: breeze",
            "encounter: breze",
            "21:16: held_out.far.encounter: there is no encounter `breze`; did you mean `breeze`?",
        ),
        (
            "start: 9}",
            "strat: 9}",
            "22:11: components.policy.parameters.strat: there is no parameter `strat`",
        ),
        (
            "start: 9}",
            "start: 9, seed: 1}",
            "22:50: held_out.far.set.seed: training draws the seeds of its runs",
        ),
        ("  far:", "  storm:", "20:3: held_out.storm: an encounter has this name"),
        (
            "evaluation: {runs: 4}\n",
            "",
            "19:1: held_out: nobody drives in them; write how often, e.g. `evaluation:",
        ),
        ("  storm:\n    scenario: ball.yaml", "  storm:\n    scenario: bal.yaml", "17:15: "),
        (
            "network: {type: toy-learner}",
            "network: {type: toy-learner}\nscenario: ball.yaml",
            "6:1: encounters: write one of `scenario` and `encounters`",
        ),
        (
            "held_out:",
            "scenes: {a: {b: {}}}\nheld_out:",
            "19:1: scenes: each of the `encounters` has its own; write them there",
        ),
        (
            "wind: 1.0}",
            "wind: 1.0, components.policy.parameters.silent: true}",
            "18:51: encounters.storm.set.components.policy.parameters.silent: `set` sets `comp",
        ),
        (
            "evaluation: {runs: 4}",
            "evaluation: {runs: 500000}",
            "26:20: evaluation.runs: with those of `validation` 500003 runs, more than 500000",
        ),
    ],
)
def test_problems(several: Laboratory, old: str, new: str, expected: str) -> None:
    several.change(old, new)
    found = problems(several)
    assert any(expected in each for each in found), found


def test_values_that_are_spelt_otherwise_are_the_same(several: Laboratory) -> None:
    """The variant is compared with the scenario as it was understood, its own values included."""
    several.change("start: 9}", "start: 1.0}")  # what the ball has where nothing is set
    assert any(
        "the encounter `storm` has all of these values" in each for each in problems(several)
    )


def test_recipes_extend_recipes(several: Laboratory) -> None:
    (several.folder / "own").mkdir()
    path = several.folder / "own" / "more.yaml"
    path.write_text(
        "schema: 1\nextends: ../training.yaml\nseed: 8\ncheckpoint: other.safetensors\n"
    )
    found = load_training(path)
    assert (found.seed, found.expert_seed) == (8, 3)
    assert found.checkpoint == several.folder / "own" / "other.safetensors"
    assert [each.name for each in found.encounters] == ["breeze", "storm"]
    plain = load_training(several.file)
    assert found.encounters[0].scenes == plain.encounters[0].scenes


def test_the_experts_runs_depend_on_their_own_seed_only(several: Laboratory) -> None:
    first = load_training(several.file)
    second = replace(first, seed=8)
    assert first.lessons(0) == second.lessons(0)
    assert first.validation() == second.validation()
    assert not set(first.lessons(1).seeds) & set(second.lessons(1).seeds)
    assert min(first.lessons(0).seeds) == 4_000_000
    assert min(first.lessons(1).seeds) == 8_000_006


@pytest.mark.slow
def test_a_collection_is_driven_once(several: Laboratory) -> None:
    """Another seed: the expert's lessons are not driven again, and the network is as if alone."""
    collection = Collection(several.folder / "kept" / "expert")
    several.train("alone", seed=8)
    alone = several.checkpoint
    driven = Counter(name for name, _ in phases(several))
    several.train("first", collection=collection)
    assert several.checkpoint != alone
    assert len(list(collection.directory.glob("*.npz"))) == driven["expert"] + driven["validation"]
    several.workers.done.clear()
    several.train("second", seed=8, collection=collection)
    assert several.checkpoint == alone
    shared = Counter(name for name, _ in phases(several))
    assert shared == {n: k for n, k in driven.items() if n not in {"expert", "validation"}}


@pytest.mark.parametrize("change", ["seed", "levels", "files"])
def test_what_a_run_is_known_by(several: Laboratory, change: str) -> None:
    collection = Collection(several.folder)
    work = Work(
        scenario=str(several.folder / "ball.yaml"),
        overrides=("seed=1", "components.policy.parameters.wind=0.1"),
        keep=None,
        scratch=None,
    )
    key = collection.key(work)
    assert collection.key(replace(work, keep="elsewhere")) == key
    assert collection.key(replace(work, overrides=("seed=1", *work.overrides[1:]))) == key
    if change == "seed":
        other = replace(work, overrides=("seed=2", *work.overrides[1:]))
    elif change == "levels":
        other = replace(work, overrides=("seed=1", "components.policy.parameters.wind=0.2"))
    else:
        several.change("stop: 1 s", "stop: 2 s", "ball.yaml")
        other = work
    assert collection.key(other) != key


def test_where_a_checkout_lies_does_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """FMUs that come with it are files with long paths, beside the folder of the scenario."""

    def key(place: str, content: str) -> str:
        root = tmp_path / place
        (root / "scenarios").mkdir(parents=True, exist_ok=True)
        scenario = root / "scenarios" / "drive.yaml"
        scenario.write_text(DRIVE)
        scenario.with_name("drive.csv").write_text("time [s], speed\n0, 36\n")
        files = {"lidar": {str(root / "fmus" / "lidar.fmu"): content}}
        monkeypatch.setattr("studies.training.collection.digests", lambda _: files)
        monkeypatch.setattr("studies.training.collection._ROOT", root)
        monkeypatch.setattr("studies.training.collection._sources", lambda: "the same")
        work = Work(scenario=str(scenario), overrides=(), keep=None, scratch=None)
        return Collection(tmp_path).key(work)

    assert key("one", "a") == key("two", "a") != key("two", "b")


def test_a_damaged_collection_is_driven_anew(several: Laboratory) -> None:
    collection = Collection(several.folder / "expert")
    several.train("first", collection=collection)
    expected = several.checkpoint
    texts = sorted(collection.directory.glob("*.json"))
    texts[0].write_text("{")
    texts[1].with_suffix(".npz").unlink()
    several.workers.done.clear()
    several.train("second", collection=collection)
    names = Counter(name for name, _ in phases(several))
    assert names["expert"] + names["validation"] == 2
    assert several.checkpoint == expected


@pytest.mark.slow
def test_several_seeds_and_what_differs_between_them(several: Laboratory) -> None:
    training, collection = load_training(several.file), Collection(several.folder / "expert")
    options = several.options("all")
    found = conduct_several(training, (1, 2, 3), options, collection)
    assert [each.seed for each in found] == [1, 2, 3]
    networks = [several.folder / "toy.safetensors"]
    networks += [several.folder / "all" / f"seed-{n}" / "toy.safetensors" for n in (2, 3)]
    assert len({path.read_bytes() for path in networks}) == 3
    table = rows(several.folder / "all" / "seeds.csv")
    assert [(r["seed"], r["encounter"]) for r in table[::3]] == [(n, "breeze") for n in "123"]
    summary = rows(several.folder / "all" / "spread.csv")
    assert [(r["encounter"], r["seeds"]) for r in summary] == [
        ("breeze", "3"),
        ("storm", "3"),
        ("far", "3"),
    ]
    first = several.folder / "toy.safetensors"
    first.unlink()
    several.workers.done.clear()
    again = conduct_several(training, (1, 2, 3, 4), replace(options, resume=True), collection)
    assert len(again) == 4
    assert first.exists()
    assert {name for name, _ in phases(several)} & {"expert", "validation"} == set()


@pytest.mark.slow
def test_several_seeds_go_on_where_they_were_interrupted(several: Laboratory) -> None:
    training = load_training(several.file)
    left = 20

    def check() -> None:
        nonlocal left
        left -= 1
        if left == 0:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        conduct_several(training, (1, 2), several.options("all", check=check), None)
    several.workers.done.clear()
    conduct_several(training, (1, 2), several.options("all", resume=True), None)
    parts = {n: (several.folder / "all" / f"seed-{n}" / "training.csv").exists() for n in (1, 2)}
    assert parts == {1: True, 2: True}
    assert len(several.workers.done) < 2 * 30


def test_the_spread() -> None:
    def row(seed: int, collision: float | None) -> dict[str, Any]:
        ends = {"collision": collision, "success": 0.5}
        return {"seed": seed, "encounter": "a", "held_out": False, **ends}

    (found,) = spread([row(1, 0.1), row(2, 0.2), row(3, 0.6)])
    assert found["seeds"] == 3
    assert found["collision_mean"] == pytest.approx(0.3)
    assert (found["collision_least"], found["collision_greatest"]) == (0.1, 0.6)
    assert found["collision_deviation"] == pytest.approx((0.14 / 2) ** 0.5)
    assert found["success_deviation"] == 0.0
    (single,) = spread([row(1, None)])
    assert single["collision_mean"] is single["collision_deviation"] is None


@pytest.mark.parametrize(
    ("path", "expected"),
    [("a.b", True), ("a.b.c", True), ("a", True), ("a.bc", False), ("b", False), ("a.c", False)],
)
def test_values_overlap_along_their_paths(path: str, *, expected: bool) -> None:
    assert overlap(path, {"a.b": 1}) is expected
