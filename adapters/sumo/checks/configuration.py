"""A SUMO configuration as SUMO reads it."""

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from typing_extensions import override

from adapters.sumo.checks.options import Option, options, sections
from adapters.sumo.checks.reading import Attributes, Elements, read
from orchestrator.errors import Location, Problem


@dataclass(frozen=True, slots=True)
class Setting:
    """An option that a configuration sets.

    Attributes:
        option: which one, whatever synonym the file uses.
        value: what the file says.
        where: the element that says it.
    """

    option: Option
    value: str
    where: Location

    @property
    def is_on(self) -> bool:
        """Whether it is a switch that is set."""
        return self.value.strip().lower() in _ON


_ROOT: Final = "configuration"
_ON: Final = frozenset({"true", "1", "yes", "on", "x", "t"})


def read_configuration(config: Path) -> tuple[dict[str, Setting], list[Problem]]:
    """Read a configuration.

    Options are elements at any depth, by their names or synonyms; the value is the attribute
    `value` or `v`, or the text of the element. An empty one is as good as none.

    Args:
        config: the file.

    Returns:
        The options by their full names, and everything that is wrong with the file.
    """
    elements = _Configuration()
    unreadable = read(config, elements)
    return elements.settings, [*elements.problems, *unreadable]


class _Configuration(Elements):
    def __init__(self) -> None:
        super().__init__()
        self.settings: dict[str, Setting] = {}
        self.problems: list[Problem] = []
        self._leaf: tuple[str, Location] | None = None
        self._text = ""

    @override
    def root(self, name: str, attributes: Attributes) -> bool:
        is_configuration = name.lower().endswith(_ROOT)
        if not is_configuration:
            what = f"not a SUMO configuration: it begins with `<{name}>` instead of `<{_ROOT}>`"
            self.problems.append(Problem(self._here(), what))
        return is_configuration

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        self._leaf, self._text = None, ""
        for key in ("value", "v"):
            if key in attributes:
                self._set(name, attributes[key], self._here())
                return
        self._leaf = (name, self._here())

    @override
    def text(self, data: str) -> None:
        self._text += data

    @override
    def end(self, name: str) -> None:
        if self._leaf is not None:
            leaf, where = self._leaf
            if self._text.strip():
                self._set(leaf, self._text, where)
            elif leaf not in sections():
                what = f'`{leaf}` has no value; write `<{leaf} value="..."/>`'
                self.problems.append(Problem(where, what))
        self._leaf, self._text = None, ""

    def _set(self, name: str, text: str, where: Location) -> None:
        value = text.strip()
        option = options().get(name)
        if option is None:
            close = difflib.get_close_matches(name, options(), n=1)
            hint = f"did you mean `{close[0]}`?" if close else "`sumo --help` lists them"
            self.problems.append(Problem(where, f"SUMO has no option `{name}`; {hint}"))
        elif option.name in self.settings:
            line = self.settings[option.name].where.line
            self.problems.append(Problem(where, f"`{name}` is set in line {line} already"))
        elif value:
            self.settings[option.name] = Setting(option, value, where)
            if what := option.problem(value):
                self.problems.append(Problem(where, what))
