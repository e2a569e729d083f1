"""Records come back from the files that they are written to."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import Estimate
from orchestrator.recording.layout import write_json
from studies.method import records


@dataclass(frozen=True, slots=True, kw_only=True)
class Inner:
    """A part of a record."""

    word: str
    size: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outer:
    """Every kind of field."""

    levels: Mapping[str, str]
    inner: Inner
    is_there: bool | None
    share: float
    found: Estimate | None
    late: float | None = None


SIXTHS = st.integers(-(10**9), 10**9).map(lambda n: n / 10**6)
"""Numbers that a table keeps."""

WORDS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=8)
OUTERS = st.builds(
    Outer,
    levels=st.fixed_dictionaries({"speed": WORDS, "density": WORDS}),
    inner=st.builds(Inner, word=WORDS, size=st.none() | st.integers()),
    is_there=st.none() | st.booleans(),
    share=SIXTHS | st.just(float("inf")),
    found=st.none()
    | st.builds(Estimate, SIXTHS, st.none(), st.none())
    | st.builds(Estimate, SIXTHS, SIXTHS, SIXTHS),
    late=st.none() | SIXTHS,
)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("records") / "table.csv"


@given(table=st.lists(OUTERS, max_size=4))
def test_a_table_comes_back(path: Path, table: list[Outer]) -> None:
    records.write(path, records.rows(table))
    assert records.read(path, Outer) == table


@given(record=OUTERS)
def test_a_record_comes_back_from_json(path: Path, record: Outer) -> None:
    if record.share < float("inf"):
        write_json(path, asdict(record))
        assert records.read_json(path, Outer) == record


RECORD = Outer(
    levels={"speed": "30 km/h"},
    inner=Inner(word="a, b", size=None),
    is_there=True,
    share=-1e-9,
    found=Estimate(0.5, 0.25, 0.75),
)


def test_the_columns_are_the_fields_in_their_order(path: Path) -> None:
    records.write(path, records.rows([RECORD]))
    assert path.read_text().splitlines() == [
        "speed,word,size,is_there,share,found,found_low,found_high,late",
        '30 km/h,"a, b",,True,0.0,0.5,0.25,0.75,',
    ]


def test_columns_can_be_left_out_and_those_with_a_default_be_missing(path: Path) -> None:
    records.write(path, records.rows([RECORD], without=["late"]))
    assert "late" not in path.read_text()
    (found,) = records.read(path, Outer)
    assert found.late is None


def test_an_empty_table_is_an_empty_file(path: Path) -> None:
    records.write(path, [])
    assert path.read_bytes() == b""
    assert records.read(path, Outer) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("True", "yes"), ":2: expected `True`, `False` or nothing, got `yes`"),
        (("0.25", "low"), ":2: could not convert string to float: 'low'"),
        (("found_low", "lowest"), ": there is no column 'found_low'; run the report again"),
    ],
)
def test_what_is_no_such_table_is_an_error(
    path: Path, change: tuple[str, str], message: str
) -> None:
    records.write(path, records.rows([RECORD]))
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ValueError, match=f"^{re.escape(f'{path}{message}')}$"):
        records.read(path, Outer)
