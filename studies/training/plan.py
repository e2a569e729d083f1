"""What a training consists of: phases of driving, rounds of learning, and which runs they need.

Seeds of runs. The training with the seed $s$ owns those from $10^6 (s + 1)$ up to
$10^6 (s + 2) - 1$: the lower half for learning, in the order of the phases, the upper half for
validation. No run of two trainings, and none of an evaluation with seeds below a million, is the
same. With a seed of their own, the expert's runs and those of validation and evaluation are those
of the training that has this seed; the others keep theirs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from orchestrator.experiment.schema import Settings
from orchestrator.scenario.settings_file import setting_texts
from studies.training.encounters import ENCOUNTER, Encounter, turn
from studies.training.learner import Learner, Optimisation
from studies.training.schema import MAXIMUM_RUNS

COMPONENT: Final = "policy"
"""The component of the scenario that drives."""

SAMPLE: Final = "sample"
"""Its output that is learned from."""

NETWORK, BETA = "network", "beta"
"""Its parameters that training sets; the former of every component that has it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """Runs of one kind.

    Attributes:
        name: `validation`, `expert`, `dagger-1`, ..., or `drive-0`, ....
        seeds: of the runs.
        driver: the round whose network drives; `None`: the expert alone.
        beta: how often the expert's command is taken, 0 to 1.
        is_lesson: whether the samples are kept, to learn from or to validate with.
        encounter: in which all runs are; `None`: they take turns.
    """

    name: str
    seeds: tuple[int, ...]
    driver: int | None
    beta: float
    is_lesson: bool = True
    encounter: Encounter | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Training:
    """A training file that was read and checked.

    Attributes:
        path: of the training file.
        encounters: what is driven, learned from and validated with; one at least.
        held_out: variants of encounters that are driven in at the end only.
        seed: of everything random but the expert's runs.
        expert_seed: of these; `None`: as `seed`.
        learner_name, learner: which learner.
        parameters: its parameters as they were converted; missing ones take their defaults.
        network: the same as they were written.
        expert_runs, validation_runs, drives: how many.
        evaluation_runs: drives at the end in each encounter and each variant.
        rounds, round_runs, beta, decay: of DAgger.
        optimisation: of every round.
        device: `auto`, `cpu` or `cuda`, as asked for.
        checkpoint: the absolute path of the result.
    """

    path: Path
    encounters: tuple[Encounter, ...]
    held_out: tuple[Encounter, ...] = ()
    seed: int
    expert_seed: int | None = None
    learner_name: str
    learner: type[Learner] = field(repr=False)
    parameters: Mapping[str, Any]
    network: Mapping[str, Any]
    expert_runs: int
    validation_runs: int
    drives: int
    evaluation_runs: int = 0
    rounds: int
    round_runs: int
    beta: float
    decay: float
    optimisation: Optimisation
    device: str
    checkpoint: Path

    def validation(self) -> Phase:
        """The runs that early stopping looks at."""
        first = self._expert_seed() + MAXIMUM_RUNS
        seeds = tuple(range(first, first + self.validation_runs))
        return Phase(name="validation", seeds=seeds, driver=None, beta=1.0)

    def lessons(self, number: int) -> Phase:
        """The runs that the round `number` learns from, besides those of the rounds before."""
        first = self._first_seed()
        if number == 0:
            first = self._expert_seed()
            seeds = tuple(range(first, first + self.expert_runs))
            return Phase(name="expert", seeds=seeds, driver=None, beta=1.0)
        first += self.expert_runs + (number - 1) * self.round_runs
        return Phase(
            name=f"dagger-{number}",
            seeds=tuple(range(first, first + self.round_runs)),
            driver=number - 1,
            beta=self.beta * self.decay ** (number - 1),
        )

    def drive(self, number: int) -> Phase:
        """The network of the round `number` alone, in scenes of the validation."""
        seeds = self.validation().seeds[: self.drives]
        return Phase(
            name=f"drive-{number}",
            seeds=seeds,
            driver=number,
            beta=0.0,
            is_lesson=False,
        )

    def phases(self) -> list[Phase]:
        """All, in their order."""
        found = [self.validation()]
        for number in range(self.rounds + 1):
            found += [self.lessons(number), *([self.drive(number)] if self.drives else [])]
        return found

    def evaluation(self, number: int) -> list[Phase]:
        """The network of the round `number` alone, in every encounter and every variant.

        All with the same seeds, which are none of the validation. Another round has other phases:
        what the network of one did says nothing of the next.
        """
        first = self._expert_seed() + MAXIMUM_RUNS + self.validation_runs
        seeds = tuple(range(first, first + self.evaluation_runs))
        return [
            Phase(
                name=f"evaluation-{number}-{each.name}" if each.name else f"evaluation-{number}",
                seeds=seeds,
                driver=number,
                beta=0.0,
                is_lesson=False,
                encounter=each,
            )
            for each in (*self.encounters, *self.held_out)
            if self.evaluation_runs
        ]

    def encounter(self, phase: Phase, seed: int) -> Encounter:
        """Where the run of a phase with `seed` is."""
        return phase.encounter or turn(self.encounters, seed)

    def scene(self, phase: Phase, seed: int) -> dict[str, str]:
        """Which scene that run is: the level of every factor, and the encounter if it has a name.

        Args:
            phase: of the run.
            seed: of the run.
        """
        found = self.encounter(phase, seed)
        return {**({ENCOUNTER: found.name} if found.name else {}), **found.levels(seed)}

    def _first_seed(self) -> int:
        return (self.seed + 1) * 2 * MAXIMUM_RUNS

    def _expert_seed(self) -> int:
        seed = self.seed if self.expert_seed is None else self.expert_seed
        return (seed + 1) * 2 * MAXIMUM_RUNS


def driver_texts(users: Sequence[str], network: Path | None, beta: float) -> tuple[str, ...]:
    """The overrides that say who drives.

    Args:
        users: components that use the network.
        network: its checkpoint; `None`: the expert drives.
        beta: how often the expert's command is taken.
    """
    path = "" if network is None else str(network.absolute())
    settings: Settings = {f"components.{name}.parameters.{NETWORK}": path for name in users}
    return tuple(setting_texts({**settings, f"components.{COMPONENT}.parameters.{BETA}": beta}))
