"""The file of a campaign: a scenario, and the levels of the factors that set values of it."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Self, TypeAlias, TypeVar

from pydantic import BaseModel, ValidationError

from orchestrator.errors import ScenarioError
from orchestrator.scenario import diagnosis, extension
from orchestrator.scenario.document import Address
from orchestrator.scenario.installed import NoSuchScenarioError, scenario_beside
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.settings_file import SettingsFile

Model = TypeVar("Model", bound=BaseModel)
Settings: TypeAlias = Mapping[str, Any]
"""Values of the scenario by their paths."""


def resolved(scenario: Scenario) -> Mapping[str, Any]:
    """What the runs of a campaign have in common: the scenario without its seed."""
    found = scenario.resolved()
    del found["seed"]
    return found


@dataclass(frozen=True, slots=True)
class Factors:
    """The factors of a file, their levels, and what these set.

    Attributes:
        source: the file.
        key: under which the factors are written there, an address.
        levels: by factor and level, the settings.
    """

    source: SettingsFile
    key: Address
    levels: Mapping[str, Mapping[str, Settings]]

    def settings(self) -> Iterator[tuple[str, Address]]:
        """Every path that a level sets: who sets it, and its address."""
        for factor, levels in self.levels.items():
            for level, settings in levels.items():
                for path in settings:
                    yield f"the factor `{factor}`", (*self.key, factor, level, path)

    def overrides(self, chosen: Mapping[str, str]) -> list[str]:
        """What one level of every factor sets, as `nlosim run --set` takes it."""
        return [
            text
            for factor, level in chosen.items()
            for text in self.source.overrides(
                self.levels[factor][level], (*self.key, factor, level)
            )
        ]

    @contextlib.contextmanager
    def loading(self, chosen: Mapping[str, str]) -> Iterator[None]:
        """Problems of the scenario with these levels become problems of the file."""
        try:
            yield
        except ScenarioError as error:
            self.source.add_of_scenario(error.problems, chosen)


@dataclass(slots=True)
class Load(Generic[Model]):
    """One reading of the file of a campaign.

    Attributes:
        path: of the file.
        source: where everything was written; notes the problems.
        file: what was written.
        factors: of the file.
    """

    path: Path
    source: SettingsFile
    file: Model
    factors: Factors

    @classmethod
    def of(cls, path: Path, model: type[Model], noun: str, factors: str) -> Self:
        """The reading of a file that has the right shape.

        Args:
            path: of the file.
            model: its shape.
            noun: what messages call the campaign.
            factors: the key under which the factors are written.

        Raises:
            ScenarioError: all problems of the shape, each at its place.
        """
        source, file = _read(path, model, noun)
        return cls(path, source, file, Factors(source, (factors,), getattr(file, factors)))

    def scenario_path(self, scenario: str, address: Address = ("scenario",)) -> Path:
        """The absolute path of the scenario file; that there is none is a problem.

        Args:
            scenario: as it is written in the file of the campaign.
            address: where.
        """
        folder = self.source.document.folder(address)
        try:
            return scenario_beside(folder, scenario).absolute()
        except NoSuchScenarioError as error:
            self.source.add(address, str(error))
            return (folder / scenario).absolute()


def _read(path: Path, model: type[Model], noun: str) -> tuple[SettingsFile, Model]:
    """The file of a campaign, if it has the right shape."""
    document = extension.read(path)
    try:
        return SettingsFile(document), model.model_validate(document.data)
    except ValidationError as error:
        found = diagnosis.problems(document, model, error, whole=f"the {noun}")
        raise ScenarioError(sorted(found, key=lambda p: p.where)) from None
