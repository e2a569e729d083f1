"""FMI 2.0: variables of one base type with one value reference have one value."""

import zipfile
from pathlib import Path

import pytest

from adapters.fmi.validation.validate import validate

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="a" guid="g">
<CoSimulation modelIdentifier="a"/>
<ModelVariables>
"""
TAIL = "</ModelVariables><ModelStructure/></fmiModelDescription>"


def said_of(folder: Path, *variables: str) -> list[str]:
    """What is said of aliases, where each variable is `NAME REFERENCE TYPE ATTRIBUTES`."""
    text = HEAD
    for variable in variables:
        name, reference, kind, more = variable.split(" ", 3)
        own, _, typed = more.partition(" / ")
        text += f'<ScalarVariable name="{name}" valueReference="{reference}" {own}>'
        text += f"<{kind} {typed}/></ScalarVariable>\n"
    path = folder / "a.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text + TAIL)
    return [each.what for each in validate(path) if "is an alias of" in each.what]


LOCAL = 'causality="local" variability="continuous"'
INPUT = 'causality="input" variability="continuous" / start="1"'


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (f"x 1 Real {LOCAL}", f"y 1 Real {LOCAL}", ""),
        (f"x 1 Real {INPUT}", f"y 2 Real {INPUT}", ""),
        (f"x 1 Real {INPUT}", f"y 1 Real {INPUT}", "both can be set"),
        (f'x 1 Real {LOCAL} / unit="m"', f'y 1 Real {LOCAL} / unit="s"', "their units differ"),
        (
            f"x 1 Real {LOCAL}",
            'y 1 Real causality="local" variability="constant" / start="1"',
            "only one of them is constant",
        ),
    ],
)
def test_aliases_agree(tmp_path: Path, first: str, second: str, said: str) -> None:
    found = said_of(tmp_path, first, second)
    expected = [f"`y` is an alias of `x` (in line 5), but {said}"] if said else []
    assert found == expected
