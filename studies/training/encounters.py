"""What is driven in a training: encounters, each a scenario with what varies in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from orchestrator.campaign.loading import Settings
from orchestrator.randomness import stream
from orchestrator.scenario.settings_file import setting_texts

ENCOUNTER = "encounter"
"""The name under which a run says which encounter it was, beside its levels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """A scenario, and what varies in it from run to run.

    Attributes:
        name: in the training file; empty if that names a scenario alone.
        scenario: the absolute path of the scenario file.
        weight: so many runs in turn are of it; 0 if it is held out.
        settings: what is set in every run.
        scenes: settings by factor and level.
        users: components with a parameter `network`, which use the network in training.
        resolved: the scenario with the first level of every factor and the expert; no seed.
        is_held_out: whether it is never learned from, but driven at the end.
    """

    name: str
    scenario: Path
    weight: int = 1
    settings: Settings
    scenes: Mapping[str, Mapping[str, Settings]]
    users: tuple[str, ...] = ()
    resolved: Mapping[str, Any] = field(default_factory=dict, repr=False)
    is_held_out: bool = False

    def levels(self, seed: int) -> dict[str, str]:
        """The scene of the run with `seed`: one level of every factor, all equally likely.

        The level of a factor does not depend on the other factors.
        """
        return {
            factor: list(levels)[stream(seed, f"scenes/{factor}").integers(len(levels))]
            for factor, levels in self.scenes.items()
        }

    def overrides(self, levels: Mapping[str, str]) -> tuple[str, ...]:
        """What the encounter and these levels of its factors set, as `nlosim run --set` takes it.

        Args:
            levels: by factor; those that are none of its factors are left alone.
        """
        chosen = [self.scenes[factor][levels[factor]] for factor in self.scenes]
        return tuple(text for each in (self.settings, *chosen) for text in setting_texts(each))

    def variant(self, name: str, settings: Settings) -> Self:
        """Make the variant of this encounter that is held out.

        Args:
            name: of the variant.
            settings: what makes it one. Factors that set one of these values, or a part of one,
                do not vary in it.
        """
        free = {
            factor: levels
            for factor, levels in self.scenes.items()
            if not any(overlap(path, settings) for each in levels.values() for path in each)
        }
        kept = {path: value for path, value in self.settings.items() if not overlap(path, settings)}
        return replace(
            self, name=name, settings={**kept, **settings}, scenes=free, is_held_out=True
        )


def overlap(path: str, settings: Settings) -> bool:
    """Whether `settings` has a value at this path, within it or around it."""
    keys = path.split(".")
    others = [other.split(".") for other in settings]
    return any(keys[: len(o)] == o[: len(keys)] for o in others)


def turn(encounters: Sequence[Encounter], seed: int) -> Encounter:
    """The encounter of the run with `seed`: they take turns, each `weight` times in a cycle."""
    cycle = [each for each in encounters for _ in range(each.weight)]
    return cycle[seed % len(cycle)]
