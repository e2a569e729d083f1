"""The structure of parameter types, and read-only mappings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import pytest
from hypothesis import given, strategies as st

from orchestrator.kinds import (
    FrozenMapping,
    Leaf,
    Listed,
    Named,
    Optional,
    Record,
    is_record,
    kind_of,
    record_in,
)
from orchestrator.parameters import parameter


@dataclass(frozen=True)
class Place:
    """Both of its fields are parameters."""

    lane: str = parameter(doc="of the net")
    s: float = parameter(0.0, doc="along it")


@dataclass(frozen=True)
class Nothing:
    """Without fields, all of them are parameters."""


@dataclass(frozen=True)
class Mixed:
    """One of its fields is none."""

    lane: str = parameter(doc="of the net")
    s: float = field(default=0.0)


@dataclass
class Changing:
    """Not frozen."""

    lane: str = parameter(doc="of the net")


def test_a_record_is_a_frozen_dataclass_all_of_whose_fields_are_parameters() -> None:
    assert is_record(Place)
    assert is_record(Nothing)
    for other in (Mixed, Changing, Place("a"), int, str, "Place", None, list[int], Place | None):
        assert not is_record(other), other


@pytest.mark.parametrize(
    ("annotation", "kind"),
    [
        (Place, Record(Place)),
        (Mixed, Leaf(Mixed)),
        (float, Leaf(float)),
        (Literal["a", "b"], Leaf(Literal["a", "b"])),
        (Place | None, Optional(Place)),
        (None | Place, Optional(Place)),
        (int | str, Leaf(int | str)),
        (int | str | None, Optional(int | str)),
        (tuple[Place, ...], Listed(Place)),
        (Mapping[str, Place | None], Named(Place | None)),
        (Mapping[int, Place], Leaf(Mapping[int, Place])),
    ],
)
def test_a_kind_is_the_outermost_structure(annotation: Any, kind: object) -> None:
    assert kind_of(annotation) == kind


def test_the_record_in_a_type_is_found_however_deep_it_is() -> None:
    deep = Mapping[str, tuple[Mapping[str, Place | None], ...] | None]
    assert record_in(deep) is record_in(Place) is Place
    for without in (float, tuple[float, ...], Mapping[str, Mixed], int | str):
        assert record_in(without) is None


ENTRIES = st.dictionaries(st.sampled_from("abc"), st.integers(0, 2))


@given(ENTRIES, ENTRIES)
def test_read_only_mappings_are_values(left: dict[str, int], right: dict[str, int]) -> None:
    """Equal, with equal hashes, to all with the same entries in any order; of its own entries."""
    one, other = FrozenMapping(left), FrozenMapping(right)
    assert (one == other) == (left == right)
    turned = FrozenMapping(dict(reversed(left.items())))
    assert turned == one
    assert hash(turned) == hash(one)
    assert list(one.items()) == list(left.items())
    left["d"] = 5
    assert "d" not in one
    assert len(one) == len(left) - 1
