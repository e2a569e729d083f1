"""A component whose input file names further ones, line by line."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from typing_extensions import override

from orchestrator.errors import Location, ParameterProblem, Problem
from orchestrator.input_files import FileCheck, FileReadingComponent
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from tests.idle import Idle

CHECKS: Final[list[bool]] = []
"""For each check since it was last emptied, whether it was to be thorough."""


class Reader(Idle, FileReadingComponent):
    """Reads files."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        list: Path = parameter(doc="text file with one path per line, relative to it")
        first: int = parameter(0, doc="the first line that matters")
        last: int = parameter(99, doc="the last one")

        def __post_init__(self) -> None:
            if self.first > self.last:
                raise ValueError("`first` is after `last`")

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters

    @classmethod
    @override
    def input_files(cls, parameters: Parameters) -> Iterable[Path]:
        named = parameters.list
        if not named.is_file():
            return
        lines = named.read_text(encoding="utf-8").splitlines()
        yield from (path for line in lines if (path := named.parent / line).is_file())

    @classmethod
    @override
    def check_files(cls, parameters: Parameters, *, thorough: bool) -> FileCheck:
        CHECKS.append(thorough)
        named = parameters.list
        if not named.is_file():
            return FileCheck()
        lines = named.read_text(encoding="utf-8").splitlines()
        places = [Location(str(named), number, 1) for number in range(1, len(lines) + 1)]
        missing = [
            Problem(where, f"there is no `{line}`")
            for where, line in zip(places, lines, strict=True)
            if line and not (named.parent / line).is_file()
        ]
        empty = () if lines else (ParameterProblem(("list",), "the list is empty"),)
        twice = [
            Problem(where, f"`{line}` is named twice")
            for index, (where, line) in enumerate(zip(places, lines, strict=True))
            if line and line in lines[:index]
        ]
        return FileCheck(problems=(*missing, *empty), remarks=tuple(twice))

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {"count": Connector(causality=Causality.OUTPUT)}

    @override
    def outputs(self) -> Signals:
        return {"count": np.zeros(())}
