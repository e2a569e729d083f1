"""The page on the wire format says what the code does."""

import re
from pathlib import Path

from orchestrator.remote import block, protocol
from orchestrator.tap import server, stream, watcher

PAGE = (Path(__file__).parents[2] / "docs" / "wire-format.md").read_text(encoding="utf-8")


def test_both_versions_are_those_of_the_page() -> None:
    assert f"| 4, 5 | u16 version: {protocol.VERSION} | u16 version: {stream.VERSION} |" in PAGE
    assert f"magic `{stream.MAGIC.decode()}`" in PAGE
    assert protocol.Message(protocol.Kind.STEP, 0, 0).encode()[:4] == b"NLOS"
    assert stream.HEADER.size == len(protocol.Message(protocol.Kind.STEP, 0, 0).encode()) == 48


def test_kinds_have_the_numbers_of_the_page() -> None:
    found = {name: int(number) for name, number in re.findall(r"([A-Z_]{3,}) \| (\d+)", PAGE)}
    kinds = {kind.name: kind.value for each in (protocol.Kind, stream.Kind) for kind in each}
    assert found == kinds


def test_forms_have_the_numbers_of_the_page() -> None:
    forms = [int(number) for number in re.findall(r"^\| (\d) \| is ", PAGE, re.MULTILINE)]
    named = ("UNCHANGED", "DECLARED", "FOREIGN", "BINARY", "PLACED", "PLACED_BINARY", "NAMED")
    assert forms == [getattr(block, name) for name in named]


def test_the_limits_are_those_of_the_page() -> None:
    assert f"at most {watcher.MOST_PER_SECOND:g} times a second" in PAGE
    assert f"at most {server.SHARE:.0%} of its time".replace("%", " %") in PAGE
    assert f"{watcher.USUAL_PER_SECOND:g} unless" in PAGE
    assert server.LARGEST == 64 * 1024
    assert "more than 64 KB are sent only to readers who name signals" in PAGE


def test_fields_of_the_schema_are_on_the_page() -> None:
    document = stream.Schema.of("r", (0, 1), ["a"], {}).to_document()
    for name in (*document, *document["signals"][0]):
        assert f"`{name}`" in PAGE, name
    assert f"`{stream.PUBLISHED}`" in PAGE
    assert f"`{stream.PUBLICATIONS}`" in PAGE
