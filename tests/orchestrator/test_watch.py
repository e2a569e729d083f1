"""Which commands are waited for in another process."""

import sys

import pytest

from orchestrator.cli.watch import Watch, is_watched


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("run red_light", True),
        ("--json run red_light", True),
        ("run red_light --help", False),
        ("run -h", False),
        ("fmu run a.fmu", True),
        ("fmu compare a.fmu b.fmu", True),
        ("fmu build", False),
        ("check run", False),
        ("experiment run", False),
        ("", False),
    ],
)
def test_those_that_call_components_are(arguments: str, *, expected: bool) -> None:
    assert is_watched(arguments.split()) == (expected and sys.platform == "linux")


def test_nobody_is_told_where_nobody_waits(tmp_path: object) -> None:
    watch = Watch()
    watch.begin(tmp_path)  # type: ignore[arg-type]
    assert not watch.is_told
