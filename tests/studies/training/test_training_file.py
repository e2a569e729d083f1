"""Training files: what they mean, and every problem at its place."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from orchestrator.errors import ScenarioError
from studies.training.encounters import Encounter
from studies.training.learner import Optimisation
from studies.training.load import load_training
from studies.training.plan import Training
from studies.training.schema import MAXIMUM_RUNS, MAXIMUM_SEED
from tests.studies.training.conftest import Laboratory
from tests.studies.training.toys import Line


def problems(laboratory: Laboratory) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        load_training(laboratory.file)
    return [str(each).replace(f"{laboratory.folder}/", "") for each in error.value.problems]


def without_scenes(laboratory: Laboratory) -> None:
    before, _, rest = laboratory.file.read_text().partition("scenes:")
    laboratory.file.write_text(before + rest[rest.index("expert:") :])


def test_a_training_file(laboratory: Laboratory) -> None:
    training = load_training(laboratory.file)
    assert (training.learner, training.learner_name) == (Line, "toy-learner")
    assert training.checkpoint == laboratory.folder / "toy.safetensors"
    assert training.optimisation.weight_decay == 0.0
    policy = training.encounters[0].resolved["components"]["policy"]["parameters"]
    assert (policy["wind"], policy["start"], policy["network"]) == (0.1, -2.0, "")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "seed: 7",
            "seeds: 7",
            "3:1: the training: `seeds` is not a key here; did you mean `seed`?",
        ),
        ("seed: 7", "seed: 1.5", "3:7: seed: expected a whole number, got 1.5"),
        ("seed: 7", "seed: -1", "3:7: seed: must be at least 0, got -1"),
        (
            "ball.yaml",
            "bal.yaml",
            "2:11: scenario: there is no file bal.yaml (the path is relative",
        ),
        (
            "{type: toy-learner}",
            "{type: toy-lerner}",
            (
                "4:17: network.type: no learner `toy-lerner` is installed; "
                "did you mean `toy-learner`?"
            ),
        ),
        (
            "{type: toy-learner}",
            "{type: toy-policy}",
            "4:17: network.type: the learner `toy-policy` is not a class derived from `Learner`",
        ),
        (
            "{type: toy-learner}",
            "{type: lacking}",
            (
                "No module named 'tests.studies.training.lacking'; our learners need: "
                "pip install 'nlosim[train]'"
            ),
        ),
        ("{type: toy-learner}", "{momentum: 0.3}", "4:1: network: `type` is missing"),
        ("{type: toy-learner}", "{type: 3}", "4:17: network.type: expected text, got 3"),
        (
            "toy-learner}",
            "toy-learner, momentun: 0.3}",
            ("4:30: network.momentun: there is no parameter `momentun`; did you mean `momentum`?"),
        ),
        (
            "toy-learner}",
            "toy-learner, momentum: 3}",
            ("4:40: network.momentum: must be at most 0.99, got 3"),
        ),
        (
            "toy-learner}",
            "toy-learner, degree: 2}",
            ("4:1: network: `degree` 2 is not supported; write 1"),
        ),
        (
            "wind: 0.1",
            "wnid: 0.1",
            (
                "7:12: components.policy.parameters.wnid: there is no parameter `wnid`; "
                "did you mean `wind`?"
            ),
        ),
        (
            "wind: 0.1",
            "wind: much",
            ('7:47: components.policy.parameters.wind: "much": `much` is not a number'),
        ),
        (
            "wind: 0.1}",
            "wind: 0.1, seed: 3}",
            (
                "7:52: scenes.wind.calm.seed: training draws the seeds of its runs from its own "
                "`seed`; remove it"
            ),
        ),
        (
            "wind: 0.1}",
            "wind: 0.1, components.policy.parameters.beta: 1}",
            (
                "7:52: scenes.wind.calm.components.policy.parameters.beta: training sets it; "
                "remove it"
            ),
        ),
        (
            "parameters.start: 2",
            "parameters.wind: 2",
            (
                "11:13: scenes.start.right.components.policy.parameters.wind: the factor `wind` "
                "sets `components.policy.parameters.wind`, too"
            ),
        ),
        ("{runs: 4}", "{runs: 0}", "12:16: expert.runs: must be at least 1, got 0"),
        ("rounds: 2", "rounds: 200000", "dagger.rounds"),
        ("beta: 0.5", "beta: 1.5", "13:36: dagger.beta: Input should be less than or equal to 1"),
        (
            "{runs: 2}",
            "{runs: 2, drives: 3}",
            ("14:31: validation.drives: more than the 2 scenes of `validation.runs`"),
        ),
        ("rate: 0.05", "rate: 0", "15:43: optimisation.rate: Input should be greater than 0"),
        ("rate: 0.05", "rate: .nan", "15:43: optimisation.rate: "),
        ("device: cpu", "device: gpu", "16:9: device: expected `auto`, `cpu` or `cuda`"),
        ("toy.safetensors", "x/toy.safetensors", "17:13: checkpoint: there is no folder x"),
        ("toy.safetensors", ".", "17:13: checkpoint: "),
    ],
)
def test_problems(laboratory: Laboratory, old: str, new: str, expected: str) -> None:
    laboratory.change(old, new)
    (problem,) = problems(laboratory)
    assert problem.startswith("training.yaml:")
    assert expected in problem


def test_all_problems_at_once(laboratory: Laboratory) -> None:
    laboratory.change("toy-learner}", "toy-learner, momentum: 3}")
    laboratory.change("toy.safetensors", "x/toy.safetensors")
    laboratory.change("{runs: 2}", "{runs: 2, drives: 3}")
    assert [problem.split(": ")[1] for problem in problems(laboratory)] == [
        "network.momentum",
        "validation.drives",
        "checkpoint",
    ]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "toy-policy",
            "toy-bystander",
            (
                "`policy` of the scenario is of the type `toy-bystander`, which has no parameter "
                "`network` and `beta`; training needs one that has, such as `policy-dagger`"
            ),
        ),
        ("toy-policy", "toy-plain-policy", "`policy.sample` is float64[]; training reads bytes"),
        ("policy: {", "driver: {", "the scenario has no component `policy`"),
        (
            "[policy.sample]",
            "['*'], exclude: [policy.*]",
            ("its `recording` leaves `policy.sample` out; include it"),
        ),
    ],
)
def test_scenarios_that_cannot_be_trained_in(
    laboratory: Laboratory, old: str, new: str, expected: str
) -> None:
    without_scenes(laboratory)
    laboratory.change(old, new, "ball.yaml")
    if new == "driver: {":
        laboratory.change("[policy.sample]", "[driver.sample]", "ball.yaml")
    (problem,) = problems(laboratory)
    assert problem.startswith("training.yaml:2:11: scenario: ")
    assert expected in problem


def test_a_problem_of_the_scenario_is_reported_there(laboratory: Laboratory) -> None:
    laboratory.change("step: 100 ms", "step: 300 ms", "ball.yaml")
    (problem, *_) = problems(laboratory)
    assert problem.startswith("ball.yaml:5:")
    assert "(with wind calm, start left)" in problem


SCENES = Encounter(
    name="",
    scenario=Path("ball.yaml"),
    settings={},
    scenes={"wind": {str(k): {} for k in range(4)}, "start": {"left": {}, "right": {}}},
    users=("policy",),
)
PLAN = Training(
    path=Path("training.yaml"),
    encounters=(SCENES,),
    seed=0,
    learner_name="toy-learner",
    learner=Line,
    parameters={},
    network={"type": "toy-learner"},
    expert_runs=1,
    validation_runs=1,
    drives=0,
    rounds=0,
    round_runs=1,
    beta=0.5,
    decay=0.5,
    optimisation=Optimisation(epochs=1, batch=1, rate=1.0, weight_decay=0.0, patience=1),
    device="cpu",
    checkpoint=Path("toy.safetensors"),
)
_SEEDS, _COUNTS = st.integers(0, MAXIMUM_SEED), st.integers(1, 200)


def seeds(training: Training) -> list[int]:
    return [seed for phase in training.phases() for seed in phase.seeds]


@given(
    first=_SEEDS,
    second=_SEEDS,
    counts=st.tuples(_COUNTS, _COUNTS, _COUNTS),
    rounds=st.integers(0, 9),
)
def test_no_run_is_driven_twice(
    first: int, second: int, counts: tuple[int, int, int], rounds: int
) -> None:
    """Not in one training, not in another, and not in an evaluation with seeds of its own."""
    expert, lessons, validation = counts
    plan = replace(
        PLAN,
        seed=first,
        expert_runs=expert,
        validation_runs=validation,
        rounds=rounds,
        round_runs=lessons,
    )
    used = seeds(plan)
    assert len(set(used)) == len(used) == expert + validation + rounds * lessons
    assert min(used) >= 1_000_000
    if first != second:
        assert not set(used) & set(seeds(replace(plan, seed=second)))


def test_neighbouring_trainings_do_not_meet_even_when_full() -> None:
    full = replace(PLAN, expert_runs=MAXIMUM_RUNS, validation_runs=MAXIMUM_RUNS)
    first, second = seeds(full), seeds(replace(full, seed=1))
    assert len(set(first)) == len(first) == 2 * MAXIMUM_RUNS
    assert max(first) < min(second)


def test_drives_are_in_scenes_of_the_validation() -> None:
    plan = replace(PLAN, validation_runs=9, drives=4, rounds=2)
    for number in range(3):
        assert plan.drive(number).seeds == plan.validation().seeds[:4]
        assert plan.drive(number).beta == 0.0


@given(beta=st.floats(0, 1), decay=st.floats(0, 1), number=st.integers(1, 20))
def test_the_expert_is_asked_less_and_less(beta: float, decay: float, number: int) -> None:
    """With beta = decay = p it is p^i, as section 3 of Ross, Gordon and Bagnell (2011) suggests."""
    plan = replace(PLAN, beta=beta, decay=decay, rounds=20)
    assert plan.lessons(number).beta == pytest.approx(beta * decay ** (number - 1))
    assert plan.lessons(0).beta == 1.0


def test_levels_are_drawn_alike_and_apart_from_each_other() -> None:
    """Pearson's statistic over eight scenes is below its 99.9 % quantile for 7 degrees, 24.3."""
    count = 4000
    scenes = Counter(tuple(SCENES.levels(seed).values()) for seed in range(10**6, 10**6 + count))
    expected = count / 8
    assert len(scenes) == 8
    assert sum((n - expected) ** 2 / expected for n in scenes.values()) < 24.3


def test_a_factor_more_changes_no_other() -> None:
    more = replace(SCENES, scenes={"queue": {"3": {}, "4": {}}, **SCENES.scenes})
    for seed in range(50):
        levels = more.levels(seed)
        del levels["queue"]
        assert levels == SCENES.levels(seed)
