"""YAML 1.2 with the place of every key and value, and errors that a person understands."""

import math
import os
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from orchestrator.errors import Location, ScenarioError
from orchestrator.scenario.document import MAXIMUM_BYTES, Document


def problems(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        Document.parse(text, "f.yaml")
    return [str(problem) for problem in error.value.problems]


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("5.9e9", 5.9e9),
        ("1e2", 100.0),
        ("1e-3", 0.001),
        (".5", 0.5),
        ("+.5", 0.5),
        ("2.", 2.0),
        ("-7", -7),
        ("010", 10),
        ("0o17", 15),
        ("0x1F", 31),
        ("1_000", "1_000"),
        ("12:30", "12:30"),
        ("on", "on"),
        ("yes", "yes"),
        ("No", "No"),
        ("true", True),
        ("FALSE", False),
        ("null", None),
        ("~", None),
        ("", None),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("2001-01-01", "2001-01-01"),
        ("'5'", "5"),
        ('"true"', "true"),
        ("!!str 5", "5"),
        ("!!float 3", 3.0),
        ("0b11", "0b11"),
        ("=", "="),
    ],
)
def test_scalars_are_those_of_yaml_1_2(written: str, value: object) -> None:
    read = Document.parse(f"a: {written}\n", "f.yaml").data["a"]
    assert read == value
    assert type(read) is type(value)


def test_not_a_number_is_read() -> None:
    assert math.isnan(Document.parse("a: .nan", "f.yaml").data["a"])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_that_python_writes_is_read_back(number: float) -> None:
    assert Document.parse(f"a: {number!r}", "f.yaml").data["a"] == number


def test_keys_and_values_know_their_places() -> None:
    document = Document.parse("a:\n  b: [1,\n      {c: 2}]\n", "f.yaml")
    assert str(document.key(("a", "b"))) == "f.yaml:2:3"
    assert str(document.value(("a", "b"))) == "f.yaml:2:6"
    assert str(document.key(("a", "b", 1, "c"))) == "f.yaml:3:8"
    assert str(document.value(("a", "b", 1, "c"))) == "f.yaml:3:11"
    assert str(document.value(("a", "missing", "beneath"))) == "f.yaml:2:3"


def test_an_alias_stands_for_its_anchor() -> None:
    document = Document.parse("a: &x {b: 1}\nc: *x\n", "f.yaml")
    assert document.data == {"a": {"b": 1}, "c": {"b": 1}}
    assert str(document.value(("c", "b"))) == "f.yaml:1:11"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f.yaml:1:1: the file is empty"),
        ("# only a comment\n", "f.yaml:1:1: the file is empty"),
        ("a: 1\nb: 2\na: 3\n", "f.yaml:3:1: the key `a` appears twice, first in line 1"),
        ("a: {b: 1, 'b': 2}", "f.yaml:1:11: the key `b` appears twice"),
        ("a:\n\tb: 1", "f.yaml:2:1: a tab cannot be used for indentation; write spaces"),
        ("a: &x {b: 1}\nc: {<<: *x}", "f.yaml:2:5: merge keys are not part of YAML 1.2"),
        ("a: b: c", "f.yaml:1:5: this `:` is not expected here"),
        ("a: [1, 2\nb: 3", "f.yaml:2:2: the list opened with `[` in line 1 is not closed"),
        ("\na: {b: 1", "the mapping opened with `{` in line 2 is not closed"),
        ("a: 'abc", "the quote opened in line 1 is not closed"),
        ("a: 1\nb: 2\n c: 3\n", "f.yaml:3:3: this `:` is not expected here"),
        ("- 1\na: 2", "f.yaml:2:1: the indentation does not match the lines above"),
        ("a: @x", "f.yaml:1:4: a value cannot start with this character"),
        ("a: *x", "f.yaml:1:4: this alias has no anchor `&` before it"),
        ("a: &x [*x]", "f.yaml:1:4: this value contains itself through an alias"),
        ("a: 1\n---\nb: 1", "f.yaml:2:1: a second document begins here"),
        ("a: !!python/name:os.system x", "f.yaml:1:4: the tag `!!python/name:os.system` has no"),
        ("a: !include x", "f.yaml:1:4: the tag `!include` has no meaning here"),
        ("a: !!int abc", "f.yaml:1:4: `abc` cannot be read as !!int"),
        ("? [1]\n: 2", "f.yaml:1:3: a key must be text"),
        ("a: " + "9" * 5000, "f.yaml:1:4: a number of 5000 digits is too long"),
        ("[" * 5000, "nested too deeply"),
        ("a: " + "[" * 100 + "]" * 100, "nested too deeply"),
        ("a: 1\nb: \x01", "f.yaml:2:4: the character U+0001 is not allowed"),
    ],
)
def test_what_is_not_a_document_is_located(text: str, message: str) -> None:
    assert message in problems(text)[0]


def test_all_problems_of_a_document_are_reported_at_once() -> None:
    assert problems("a: !x 1\nb: 1\nb: 2\nc: {<<: {}}") == [
        "f.yaml:1:4: the tag `!x` has no meaning here; remove it",
        "f.yaml:3:1: the key `b` appears twice, first in line 2",
        "f.yaml:4:5: merge keys are not part of YAML 1.2; write the keys out",
    ]


def test_aliases_do_not_explode() -> None:
    lines = ["a0: &a0 [" + ", ".join("x" * 9) + "]"]
    lines += [f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * 9) + "]" for i in range(1, 9)]
    assert "aliases expand to more than 100000 values" in problems("\n".join(lines))[0]


def test_files_that_cannot_be_read_are_problems(tmp_path: Path) -> None:
    latin = tmp_path / "latin.yaml"
    latin.write_bytes("a: 1\nb: Straße".encode("latin-1"))
    for path, message in (
        (tmp_path / "nowhere.yaml", "nowhere.yaml:1:1: cannot be read: there is no such file"),
        (tmp_path, ":1:1: cannot be read: it is a directory, not a file"),
        (latin, "latin.yaml:2:8: byte 0xdf is not UTF-8; save the file with the encoding UTF-8"),
    ):
        with pytest.raises(ScenarioError) as error:
            Document.read(path)
        assert message in str(error.value)


def test_a_byte_order_mark_is_no_content(tmp_path: Path) -> None:
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    document = Document.read(path)
    assert document.data == {"a": 1}
    assert document.key(("a",)).column == 1


@pytest.mark.parametrize("escape", ["\\U00110000", "\\UFFFFFFFF", "\\uD800", "\\ud83d\\ude00"])
def test_an_escape_that_is_no_character_is_refused_where_it_is(escape: str) -> None:
    (problem,) = problems(f'a: 1\nb: "two {escape}"\n')
    assert problem.startswith("f.yaml:2:")
    assert "an escape that is no character" in problem
    assert Document.parse('a: "\\U0010FFFF"\n', "f.yaml").data["a"] == "\U0010ffff"


def test_what_never_ends_is_not_read(tmp_path: Path) -> None:
    """Devices and pipes, and files that are larger than a document can be."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b" " * (MAXIMUM_BYTES + 1))
    (tmp_path / "folder").mkdir()
    for path, what in (
        (Path("/dev/zero"), "it is a device, not a file"),
        (tmp_path / "pipe", "it is a pipe, not a file"),
        (tmp_path / "folder", "it is a directory, not a file"),
        (tmp_path / "large", "it has 16777217 bytes; 16777216 are the most"),
    ):
        with pytest.raises(ScenarioError) as error:
            Document.read(path)
        (problem,) = error.value.problems
        assert str(problem) == f"{path}:1:1: cannot be read: {what}"


def test_who_reads_a_text_again_gets_values_and_places_of_his_own() -> None:
    text = "a: [1, {b: 2}]"
    first = Document.parse(text, "one.yaml")
    first.data["a"][1]["b"] = 3
    first.data["a"].append(4)
    again = Document.parse(text, "two.yaml", offset=5)
    assert again.data == {"a": [1, {"b": 2}]}
    assert again.value(("a", 1, "b")) == Location("two.yaml", 1, 17)
    assert first.value(("a", 1, "b")) == Location("one.yaml", 1, 12)
