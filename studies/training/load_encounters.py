"""The encounters of a training file: every scenario at every level, each problem at its place."""

import contextlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.campaign import loading
from orchestrator.campaign.loading import Factors, Settings
from orchestrator.errors import ScenarioError
from orchestrator.patterns import meant
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Address
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.settings_file import SettingsFile
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.signal import Causality
from studies.training.encounters import Encounter
from studies.training.plan import BETA, COMPONENT, NETWORK, SAMPLE, driver_texts
from studies.training.schema import HeldOut


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """An encounter as it is written.

    Attributes:
        name: of it; empty if the file names a scenario alone.
        scenario: the absolute path of the scenario file.
        address: of that in the training file.
        weight: so many runs in turn are of it.
        settings: what is set in every run, and the addresses of these mappings.
        factors: what varies.
    """

    name: str
    scenario: Path
    address: Address
    weight: int = 1
    settings: Sequence[tuple[Settings, Address]]
    factors: Factors

    def fixed(self) -> Iterator[tuple[str, Address]]:
        """Every path that is set in every run: who sets it, and its address."""
        for settings, address in self.settings:
            for path in settings:
                yield f"`{'.'.join(map(str, address))}`", (*address, path)


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """An encounter that was read and checked.

    Attributes:
        encounter: itself.
        scenes: the scenarios of it that were loaded, resolved: with every level once.
    """

    encounter: Encounter
    scenes: Sequence[Mapping[str, Any]]


@dataclass(slots=True)
class EncounterLoad:
    """One reading of an encounter."""

    source: SettingsFile
    section: Section
    _users: tuple[str, ...] = ()
    """Components that use a network in the first scene; others are read once if it is the same."""

    def encounter(self) -> Checked:
        """Load the scenario with every level once; problems are noted."""
        section = self.section
        varied = section.factors.levels
        first = {factor: next(iter(levels)) for factor, levels in varied.items()}
        others = [
            {**first, factor: level}
            for factor, levels in varied.items()
            for level in itertools.islice(levels, 1, None)
        ]
        found = [self._scene(levels) for levels in (first, *others)]
        scenes = [loading.resolved(scenario) for scenario in found if scenario is not None]
        return Checked(
            encounter=Encounter(
                name=section.name,
                scenario=section.scenario if found[0] is None else found[0].path,
                weight=section.weight,
                settings={k: v for settings, _ in section.settings for k, v in settings.items()},
                scenes=varied,
                users=() if found[0] is None else _users(found[0]),
                resolved=scenes[0] if scenes else {},
                is_held_out=section.weight == 0,
            ),
            scenes=scenes,
        )

    def _scene(self, levels: Mapping[str, str]) -> Scenario | None:
        """The scenario, driven by the expert; problems of settings are problems of this file."""
        section = self.section
        fixed = [t for each in section.settings for t in self.source.overrides(*each)]
        overrides = [*fixed, *section.factors.overrides(levels)]
        with section.factors.loading(levels):
            scenario = self._as_before(overrides)
            if scenario is None:
                plain = load_scenario(section.scenario, overrides)
                if not self._is_trainable(plain):
                    return None
                self._users = _users(plain)
                scenario = self._driven(overrides)
            with contextlib.closing(assemble(scenario)) as assembly:
                self._check_sample(scenario, assembly)
            return scenario
        return None

    def _driven(self, overrides: Sequence[str]) -> Scenario:
        drivers = driver_texts(self._users, None, 1.0)
        return load_scenario(self.section.scenario, [*overrides, *drivers])

    def _as_before(self, overrides: Sequence[str]) -> Scenario | None:
        """The scenario if the same components use a network as in the scene before."""
        if not self._users:
            return None
        try:
            scenario = self._driven(overrides)
        except ScenarioError:  # said better by the scenario without them
            return None
        return scenario if _users(scenario) == self._users else None

    def _is_trainable(self, scenario: Scenario) -> bool:
        use = scenario.components.get(COMPONENT)
        if use is None:
            what = f"the scenario has no component `{COMPONENT}`, which training drives with"
            self.source.add(self.section.address, what)
            return False
        missing = [n for n in (NETWORK, BETA) if n not in use.type.parameters]
        if missing:
            named = " and ".join(f"`{name}`" for name in missing)
            what = f"`{COMPONENT}` of the scenario is of the type `{use.origin()}`, which has no "
            what += f"parameter {named}; training needs one that has, such as `policy-dagger`"
            self.source.add(self.section.address, what)
        return not missing

    def _check_sample(self, scenario: Scenario, assembly: Assembly) -> None:
        name = f"{COMPONENT}.{SAMPLE}"
        connector = assembly.system.connectors[COMPONENT].get(SAMPLE)
        if connector is None or connector.causality is not Causality.OUTPUT:
            what = f"there is no output `{name}`, which training learns from"
            self.source.add(self.section.address, what)
        elif not connector.is_binary:
            what = f"`{name}` is {connector.kind()}; training reads bytes"
            self.source.add(self.section.address, what)
        elif not _is_recorded(scenario, name):
            what = f"its `recording` leaves `{name}` out; include it"
            self.source.add(self.section.address, what)


def held_out_variants(
    source: SettingsFile, written: Mapping[str, HeldOut], known: Sequence[Checked]
) -> tuple[Encounter, ...]:
    """The variants that are never learned from; that one is learned from is a problem.

    Args:
        source: the file, which notes the problems.
        written: what it says of them, by name.
        known: the encounters that are learned from.
    """
    by_name = {each.encounter.name: each.encounter for each in known}
    found = []
    for name, each in written.items():
        variant = by_name[each.encounter].variant(name, each.set)
        address = ("held_out", name, "set")
        levels = {factor: next(iter(scenes)) for factor, scenes in variant.scenes.items()}
        fixed = source.overrides(each.set, address)
        others = [t for t in variant.overrides(levels) if t not in fixed]
        drivers = driver_texts(variant.users, None, 1.0)
        with Factors(source, address, {}).loading(levels):
            scenario = load_scenario(variant.scenario, [*others, *fixed, *drivers])
            with contextlib.closing(assemble(scenario)):
                resolved = loading.resolved(scenario)
            for other in known:
                if other.encounter.is_held_out or other.encounter.scenario != variant.scenario:
                    continue
                if _is_among(each.set, resolved, other.scenes):
                    shown = f" `{other.encounter.name}`" if other.encounter.name else ""
                    what = f"is learned from: the encounter{shown} has all of these values"
                    source.add(address, what)
        found.append(variant)
    return tuple(found)


def _is_among(
    settings: Settings, variant: Mapping[str, Any], scenes: Sequence[Mapping[str, Any]]
) -> bool:
    """Whether each of the values, by its path, is in one of the scenes or another."""
    return all(
        any(_value(scene, path) == _value(variant, path) for scene in scenes) for path in settings
    )


def _value(scenario: Mapping[str, Any], path: str) -> Any:
    """The value at a path of a resolved scenario, `None` if there is none."""
    value: Any = scenario
    for key in path.split("."):
        if not isinstance(value, Mapping) or key not in value:
            return None
        value = value[key]
    return value


def _users(scenario: Scenario) -> tuple[str, ...]:
    """The components that use a network."""
    uses = scenario.components.items()
    return tuple(name for name, use in uses if NETWORK in use.type.parameters)


def _is_recorded(scenario: Scenario, name: str) -> bool:
    is_included = any(meant(pattern, [name]) for pattern in scenario.include)
    return is_included and not any(meant(pattern, [name]) for pattern in scenario.exclude)
