"""Random systems within systems: the flat connections say what each level says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.adapters.ssp.packages import component, connectors, description, link, system
from tests.adapters.ssp.test_import import imported, scenario

INPUTS, OUTPUTS = ("u", "v"), ("y", "z")
"""Of components; all in the same unit, as far as there is one."""

Change = tuple[int, int]
"""Factor and offset."""


@dataclass
class Box:
    """A system: elements by name, and for each target who drives it, and how."""

    elements: dict[str, "Box | None"] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    drivers: dict[tuple[str, str], tuple[tuple[str, str], Change]] = field(default_factory=dict)


def ports(element: Box | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return (INPUTS, OUTPUTS) if element is None else (element.inputs, element.outputs)


@st.composite
def boxes(draw: st.DrawFn, depth: int = 3) -> Box:
    found = Box()
    if depth < 3:
        found.inputs = tuple(f"i{k}" for k in range(draw(st.integers(0, 3))))
        found.outputs = tuple(f"o{k}" for k in range(draw(st.integers(0, 2))))
    for k in range(draw(st.integers(1, 3))):
        is_box = depth > 0 and draw(st.booleans())
        found.elements[f"e{k}"] = draw(boxes(depth=depth - 1)) if is_box else None
    given_: list[tuple[str, str]] = [
        (name, p) for name, element in found.elements.items() for p in ports(element)[1]
    ]
    taken = [(name, p) for name, element in found.elements.items() for p in ports(element)[0]]
    for target in [*taken, *(("", p) for p in found.outputs)]:
        own = [("", p) for p in found.inputs] if target[0] else []  # so that nothing goes round
        if [*given_, *own] and draw(st.integers(0, 3)) > 0:
            change = draw(st.sampled_from([(1, 0), (2, 3), (-1, 0), (1, 5)]))
            found.drivers[target] = (draw(st.sampled_from([*given_, *own])), change)
    return found


def text(name: str, box: Box) -> str:
    """As SSD, every other connection from its target to its source."""
    elements = [
        component(each, *INPUTS[1:], *OUTPUTS[1:], "u", "y") if inner is None else text(each, inner)
        for each, inner in box.elements.items()
    ]
    links = ""
    for k, (target, (source, (factor, offset))) in enumerate(box.drivers.items()):
        start, end = (".".join(each) for each in ((source, target) if k % 2 else (target, source)))
        inside = f'<ssc:LinearTransformation factor="{factor}" offset="{offset}"/>'
        links += link(start, end, inside if factor != 1 or offset else "")
    own = connectors(*(f"{p}:input" for p in box.inputs), *(f"{p}:output" for p in box.outputs))
    return system(name, *elements, ports=own, links=links)


Value = tuple[Fraction, str] | None


def inside(box: Box, path: str, target: tuple[str, str], given_: Mapping[str, Value]) -> Value:
    """What arrives at a target within a system, by asking level after level.

    Args:
        box: the system.
        path: of the system, with a hyphen behind it.
        target: an element, or none, and its connector.
        given_: what the inputs of the system have.
    """
    driver = box.drivers.get(target)
    if driver is None:
        return None
    (element, connector), (factor, offset) = driver
    inner = box.elements.get(element)
    if not element:
        found = given_[connector]
    elif inner is None:
        found = (number(f"{path}{element}.{connector}"), f"{path}{element}.{connector}")
    else:
        found = inside(inner, f"{path}{element}-", ("", connector), {})
    return None if found is None else (factor * found[0] + offset, found[1])


def number(name: str) -> Fraction:
    """What an output gives: different numbers for different outputs."""
    return Fraction(sum(k * ord(c) for k, c in enumerate(name, 1)), 7)


def arriving(box: Box, path: str, given_: Mapping[str, Value]) -> dict[str, Value]:
    """What arrives at all inputs of components."""
    found: dict[str, Value] = {}
    for name, inner in box.elements.items():
        around = {p: inside(box, path, (name, p), given_) for p in ports(inner)[0]}
        if inner is None:
            found |= {f"{path}{name}.{p}": value for p, value in around.items()}
        else:
            found |= arriving(inner, f"{path}{name}-", around)
    return found


@given(box=boxes())
@settings(max_examples=25, deadline=None)
def test_what_arrives_is_what_every_level_says(
    tmp_path_factory: pytest.TempPathFactory, box: Box
) -> None:
    content = description(text("top", box), rest="").replace('unit="m/s"', "")
    folder: Path = tmp_path_factory.mktemp("nested")
    found = scenario(imported(folder, content)).get("connections", [])
    expected = {k: v for k, v in arriving(box, "", {}).items() if v is not None}
    assert {each["to"]: each["from"] for each in found} == {k: v[1] for k, v in expected.items()}
    for each in found:
        gain, offset = (Fraction(each.get(key, default)) for key, default in
                        (("gain", 1), ("offset", 0)))  # fmt: skip
        assert gain * number(each["from"]) + offset == expected[each["to"]][0]
