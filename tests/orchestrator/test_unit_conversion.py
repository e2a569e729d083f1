"""Units of outputs become those of inputs: exactly as far as numbers allow, or not at all."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.elements import Elements, Span
from orchestrator.operation import applied, spelled
from orchestrator.signal import Causality, Connector
from orchestrator.transformation import Transformation, is_widening, problems
from orchestrator.unit_conversion import UnitsDifferError, conversion
from orchestrator.unit_table import SYMBOLS, exponents
from orchestrator.units import Quantity, Unit, parse_unit

LINEAR = sorted(name for name, row in SYMBOLS.items() if row.reference is None)


def _pair(source: str, target: str, *, relative: bool = False) -> tuple[Connector, Connector]:
    return (
        Connector(causality=Causality.OUTPUT, unit=source, is_relative=relative),
        Connector(causality=Causality.INPUT, unit=target, is_relative=relative),
    )


@given(
    source=st.sampled_from(LINEAR),
    target=st.sampled_from(LINEAR),
    value=st.floats(-1e6, 1e6, allow_subnormal=False),
)
def test_a_conversion_is_that_of_exact_quantities_to_four_roundings(
    source: str, target: str, value: float
) -> None:
    a, b = parse_unit(source), parse_unit(target)
    if a.exponents != b.exponents:
        with pytest.raises(UnitsDifferError, match="units differ"):
            conversion(*_pair(source, target))
        return
    found = float(applied(conversion(*_pair(source, target)), np.array(value)))
    exact = Quantity(Fraction(value), a).into(b)
    size = max(abs(exact), abs((a.offset - b.offset) / b.factor), Fraction(1, 10**300))
    assert abs(Fraction(found) - exact) <= 4 * Fraction(2) ** -53 * size


@pytest.mark.parametrize(
    ("source", "target", "text", "value", "expected"),
    [
        ("m", "m", "", 1.5, 1.5),
        ("km/h", "m/s", "* 5 / 18", 36.0, 10.0),
        ("m/s", "km/h", "* 18 / 5", 10.0, 36.0),
        ("mm", "m", "/ 1000", 3.0, 0.003),
        ("degC", "K", "+ 273.15", 20.0, 293.15),
        ("K", "degC", "- 273.15", 293.15, 20.0),
        ("1", "%", "* 100", 0.07, 7.0),
    ],
)
def test_units_are_converted_by_whole_numbers_where_there_are_any(
    source: str, target: str, text: str, value: float, expected: float
) -> None:
    operations = conversion(*_pair(source, target))
    assert spelled(operations) == text
    assert float(applied(operations, np.array(value))) == pytest.approx(expected, rel=1e-15)


def test_a_difference_has_no_offset() -> None:
    assert conversion(*_pair("degC", "K", relative=True)) == ()
    output, _ = _pair("degC", "K", relative=True)
    _, input_ = _pair("degC", "K")
    with pytest.raises(UnitsDifferError, match=r"one is a difference \(relativeQuantity\)"):
        conversion(output, input_)
    output, _ = _pair("km", "m", relative=True)
    _, input_ = _pair("km", "m")
    assert spelled(conversion(output, input_)) == "* 1000"


@pytest.mark.parametrize(("source", "target"), [("dBm", "W"), ("mW", "dBm"), ("dBm", "dBW")])
def test_levels_are_not_converted_by_a_gain(source: str, target: str) -> None:
    with pytest.raises(UnitsDifferError, match="is a level, which no gain converts"):
        conversion(*_pair(source, target))


def test_what_a_component_says_of_its_unit_counts_before_the_table() -> None:
    furlong = Unit("furlong", Fraction("201.168"), exponents(m=1))
    output = Connector(causality=Causality.OUTPUT, unit="furlong", definition=furlong)
    _, metres = _pair("1", "m")
    assert spelled(conversion(output, metres)) == "* 25146 / 125"
    short = Unit("m", Fraction("0.5"), exponents(m=1))
    own = Connector(causality=Causality.OUTPUT, unit="m", definition=short)
    other = Connector(
        causality=Causality.INPUT, unit="m", definition=Unit("m", Fraction(1), exponents(m=1))
    )
    assert spelled(conversion(own, other)) == "/ 2"
    _, seconds = _pair("1", "s")
    with pytest.raises(UnitsDifferError, match="units differ: furlong and s"):
        conversion(output, seconds)


NUMBERS = [np.dtype(f"{kind}{size}") for kind in "iu" for size in (1, 2, 4, 8)] + [
    np.dtype("f4"),
    np.dtype("f8"),
]


@pytest.mark.parametrize("target", NUMBERS, ids=str)
@pytest.mark.parametrize("source", NUMBERS, ids=str)
def test_a_widening_keeps_every_value(source: "np.dtype[Any]", target: "np.dtype[Any]") -> None:
    """Exactly those pairs of types are allowed whose extreme values come back."""
    if source.kind == "f":
        info = np.finfo(source)
        extremes = [info.max, info.eps, 1 + info.eps, info.smallest_subnormal]
    else:
        limits = np.iinfo(source)
        extremes = [limits.min, limits.max, limits.max - 1, limits.min + 1]
    values = [np.array(each, source) for each in extremes]
    with np.errstate(all="ignore"):
        is_kept = all(int(v) == int(v.astype(target)) if source.kind != "f" else
                      float(v) == float(v.astype(target)) for v in values)  # fmt: skip
    assert is_widening(source, target) == is_kept


def test_truths_are_no_numbers() -> None:
    assert is_widening(np.dtype(bool), np.dtype(bool))
    assert not is_widening(np.dtype(bool), np.dtype("i4"))
    assert not is_widening(np.dtype("i1"), np.dtype(bool))


def test_an_input_whose_length_changes_is_driven_whole() -> None:
    output = Connector(causality=Causality.OUTPUT, shape=("vehicle",))
    column = Connector(causality=Causality.OUTPUT, shape=("vehicle", 2))
    table = Connector(causality=Causality.INPUT, shape=("vehicle", 2))
    second = Elements((Span(), 1))
    (found,) = problems(output, table, Transformation(placed=second), 1)
    assert found == "elements of the target: `[:, 1]`: its length may change; drive all of it"
    single = Connector(causality=Causality.INPUT, shape=("vehicle",))
    assert problems(column, single, Transformation(picked=second), 1) == []


def test_messages_are_only_delayed_and_only_if_they_are_no_events() -> None:
    output = Connector(causality=Causality.OUTPUT, dtype=None)
    input_ = Connector(causality=Causality.INPUT, dtype=None)
    assert problems(output, input_, Transformation(delay=5, sample=6), 1) == []
    (found,) = problems(output, input_, Transformation(gain=2.0), 1)
    assert found == "a Binary has no elements and no gain, offset or sum"
    events: dict[str, Any] = {"dtype": None, "mime_type": "application/x-test; events"}
    output = Connector(causality=Causality.OUTPUT, **events)
    input_ = Connector(causality=Causality.INPUT, **events)
    (found,) = problems(output, input_, Transformation(delay=5), 1)
    assert found == "it carries events, which can be neither delayed nor sampled"
