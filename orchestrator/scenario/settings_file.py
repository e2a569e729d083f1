"""A file that sets values of a scenario by their paths: its problems, each where it is written."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from orchestrator.errors import Problem, ScenarioError
from orchestrator.scenario import diagnosis
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.overrides import Override


def setting_texts(settings: Mapping[str, Any]) -> list[str]:
    """Settings as `nlosim run --set` takes them."""
    return [f"{path}={json.dumps(value, ensure_ascii=False)}" for path, value in settings.items()]


@dataclass(slots=True)
class SettingsFile:
    """One reading of such a file, collecting problems.

    Attributes:
        document: the file.
        problems: in it, or in the scenario as it sets it.
    """

    document: Document
    problems: list[Problem] = field(default_factory=list)
    _places: dict[str, Place] = field(default_factory=dict)
    """Where each setting is written, by the file name that its locations carry."""

    def add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        """Note a problem at an address, or at the nearest one above it that is written."""
        while address not in self.document.places:
            address = address[:-1]  # a short form was written, or nothing
        where = self.document.key(address) if at_key else self.document.value(address)
        self.problems.append(Problem(where, f"{diagnosis.spell(address)}: {what}"))

    def stop_at_problems(self) -> None:
        """Go on only if there are none.

        Raises:
            ScenarioError: all of them, in the order of their places.
        """
        if self.problems:
            raise ScenarioError(sorted(set(self.problems), key=lambda p: (p.where, p.what)))

    def check_paths(
        self,
        settings: Iterable[tuple[str, Address]],
        reserved: Callable[[tuple[str, ...]], str],
    ) -> None:
        """Each value is set in one place, not where it is reserved, and is not replaced at once.

        Args:
            settings: who sets it (the levels of a factor count as one), and its address, whose
                last part is its path.
            reserved: why a path, given by its keys, must not be set; empty if it may.
        """
        owners: dict[tuple[str, ...], str] = {}
        together: dict[Address, list[Address]] = {}
        for owner, address in settings:
            self._check_order(together.setdefault(address[:-1], []), address)
            path = str(address[-1])
            keys = tuple(path.split("."))
            if reason := reserved(keys):
                self.add(address, reason, at_key=True)
            if "=" in path or not all(keys):
                what = f"`{path}` is not a path; write keys with dots, e.g. `time.stop`"
                self.add(address, what, at_key=True)
            for other, known in owners.items():
                n = min(len(keys), len(other))
                if known != owner and keys[:n] == other[:n]:
                    self.add(address, f"{known} sets `{'.'.join(other)}`, too", at_key=True)
            owners.setdefault(keys, owner)

    def _check_order(self, before: list[Address], address: Address) -> None:
        """Refuse what is written before a setting that replaces it; `before` is gone on with."""
        path = str(address[-1])
        for each in before:
            if str(each[-1]).startswith(f"{path}."):
                what = f"`{path}`, below, replaces all that is in it; write this one after it"
                self.add(each, what, at_key=True)
        before.append(address)

    def overrides(self, settings: Mapping[str, Any], address: Address) -> list[str]:
        """Settings as `setting_texts` makes them; where they are written is kept in mind.

        Args:
            settings: values by their paths.
            address: of the mapping in the file.
        """
        return [self.override(path, value, (*address, path)) for path, value in settings.items()]

    def override(self, path: str, value: Any, address: Address) -> str:
        """One setting as `setting_texts` makes it; its address in the file is kept in mind."""
        (text,) = setting_texts({path: value})
        self._places[Override(text).file] = self.document.places[address]
        return text

    def add_of_scenario(self, problems: Iterable[Problem], levels: Mapping[str, str]) -> None:
        """Note problems of the scenario; those of a setting at the place where it is written.

        Args:
            problems: of `load_scenario` with `overrides`.
            levels: by factor, those of which the settings are.
        """
        self.problems += [self._placed(problem, levels) for problem in problems]

    def _placed(self, problem: Problem, levels: Mapping[str, str]) -> Problem:
        place = self._places.get(problem.where.file)
        if place is None:
            named = ", ".join(f"{factor} {level}" for factor, level in levels.items())
            return Problem(problem.where, problem.what + (f" (with {named})" if named else ""))
        text = problem.where.file.removeprefix("--set ")
        is_key = problem.where.column <= text.index("=")
        return Problem(place.key if is_key else place.value, problem.what)
