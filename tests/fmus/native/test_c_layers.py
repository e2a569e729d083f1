"""The C files of a unit stand above each other: no two use each other, directly or by others."""

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Final

import pytest

from fmus.native.unit import UNITS, load_unit
from tests.fmus.native.c_sources import Part, parts

CONTRACTS: Final = frozenset({"fmi3_model"})
"""Headers that show a unit what several parts of the shell define; the functions of FMI itself
are declared by the standard's header."""


def circle_in(graph: Mapping[str, Iterable[str]]) -> list[str]:
    """Names that lead back to the first one; none if there is no circle."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        found: list[str] = error.args[1]
        return found
    return []


def includes(unit: Mapping[str, Part]) -> dict[str, frozenset[str]]:
    """Who includes whom, of a header and the C file of its name taken as one."""
    return {name: part.includes & unit.keys() for name, part in unit.items()}


def calls(unit: Mapping[str, Part]) -> dict[str, set[str]]:
    """Who calls whom, of a header and the C file of its name taken as one."""
    home = {function: name for name, part in unit.items() for function in part.offers}
    return {
        name: {home[function] for function in part.calls & home.keys()} - {name}
        for name, part in unit.items()
    }


@pytest.fixture(scope="module", params=UNITS)
def unit(request: pytest.FixtureRequest) -> Mapping[str, Part]:
    """The parts of a unit and of the shell around it."""
    found = load_unit(request.param)
    return parts([*found.sources(), *found.headers()])


def test_no_circle_of_includes(unit: Mapping[str, Part]) -> None:
    assert circle_in(includes(unit)) == []


def test_no_circle_of_calls(unit: Mapping[str, Part]) -> None:
    graph = calls(unit)
    assert sum(map(len, graph.values())) > len(graph) / 2, "calls are not found any more"
    assert circle_in(graph) == []


def test_what_a_file_offers_stands_in_the_header_of_its_name(unit: Mapping[str, Part]) -> None:
    contract = frozenset().union(*(unit[name].declares for name in CONTRACTS))
    for part in unit.values():
        offered = {name for name in part.offers - contract if not name.startswith("fmi3")}
        assert offered <= part.declares, part.name
        assert part.has_own_header or not offered, part.name


A: Final = "int a(void) { return 1; }\n"
B: Final = '#include "a.h"\nint b(void) { return a(); }\n'


@pytest.mark.parametrize(
    ("a", "b", "circle"),
    [
        (A, B, False),
        (f'#include "b.h"\n{A}int more(void) {{ return b(); }}\n', B, True),
        (f"{A}static int b(void) {{ return 2; }}\nint c(void) {{ return b(); }}\n", B, False),
        (f'{A}/* not b(), */ const char *text = "b()";\n', B, False),
    ],
)
def test_a_circle_is_found(a: str, b: str, *, circle: bool) -> None:
    two = {
        "a": Part.of("a", a, "int a(void);\n"),
        "b": Part.of("b", b, "int b(void);\n"),
    }
    assert bool(circle_in(calls(two))) is circle
    assert bool(circle_in(includes(two))) is circle
