"""Units: exact conversions, an algebra of prefixes, and errors that say what to write."""

import math
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from orchestrator.scenario.units import duration, format_duration
from orchestrator.unit_table import PREFIXES, SYMBOLS
from orchestrator.units import (
    NoUnitError,
    Quantity,
    Unit,
    UnitError,
    number_in,
    parse_quantity,
    parse_unit,
)

LINEAR = sorted(name for name, row in SYMBOLS.items() if row.reference is None)
PREFIXABLE = sorted(name for name, row in SYMBOLS.items() if row.takes_prefix)
NUMBERS = st.fractions(min_value=-(10**9), max_value=10**9, max_denominator=10**6)


@st.composite
def same_quantity(draw: st.DrawFn) -> tuple[str, str]:
    """Two linear units of one quantity, with prefixes."""
    first = draw(st.sampled_from(LINEAR))
    alike = [u for u in LINEAR if SYMBOLS[u].exponents == SYMBOLS[first].exponents]
    second = draw(st.sampled_from(alike))
    prefix = draw(st.sampled_from(["", *PREFIXES])) if SYMBOLS[second].takes_prefix else ""
    # a prefix may spell another symbol, e.g. m + in; the table has whole symbols first
    return first, second if prefix + second in SYMBOLS else prefix + second


@given(NUMBERS, same_quantity())
def test_a_linear_conversion_and_its_inverse_are_exact(
    number: Fraction, pair: tuple[str, str]
) -> None:
    there, back = map(parse_unit, pair)
    assert Quantity(Quantity(number, there).into(back), back).into(there) == number


@given(NUMBERS, NUMBERS, same_quantity())
def test_a_difference_is_converted_as_that_of_two_quantities(
    number: Fraction, step: Fraction, pair: tuple[str, str]
) -> None:
    source, target = map(parse_unit, pair)
    first, second = (Quantity(n, source).into(target) for n in (number, number + step))
    assert Quantity(step, source).into(target, is_difference=True) == second - first


def test_a_number_in_a_unit_that_only_its_owner_knows() -> None:
    stride = Unit("stride", Fraction(3, 4), parse_unit("m").exponents, Fraction(10))
    assert number_in("8 stride", "stride", stride) == 8
    assert number_in("13 m", "stride", stride) == 4
    assert number_in("3 m", "stride", stride, is_difference=True) == 4
    assert number_in("5", "1") == number_in("5 1", "1") == 5
    assert number_in("8 stride", "stride") == 8  # nobody needs to know what it is
    with pytest.raises(UnitError, match="nobody says what the unit `stride` is"):
        number_in("13 m", "stride")
    with pytest.raises(UnitError, match=r"expected a length \(stride\), got a time \(s\)"):
        number_in("13 s", "stride", stride)
    per_second = Unit("bit/s", Fraction(1), parse_unit("1/s").exponents)  # FMI knows no bits
    assert number_in("6 Mbit/s", "bit/s", per_second) == 6_000_000
    with pytest.raises(NoUnitError, match=r"^has no unit; write `13 stride`$"):
        number_in("13", "stride", stride)


@given(NUMBERS, same_quantity(), same_quantity())
def test_units_multiply_as_their_factors_do(
    number: Fraction, left: tuple[str, str], right: tuple[str, str]
) -> None:
    one, other = (parse_unit(f"{a}.{b}") for a, b in zip(left, right, strict=True))
    if one.exponents != other.exponents:
        with pytest.raises(UnitError, match="expected"):
            Quantity(number, one).into(other)
    else:
        assert Quantity(number, one).into(other) == number * one.factor / other.factor


@pytest.mark.parametrize("symbol", PREFIXABLE)
def test_a_prefix_multiplies_by_its_power_of_ten(symbol: str) -> None:
    plain = parse_unit(symbol)
    for prefix, power in PREFIXES.items():
        if prefix + symbol not in SYMBOLS:  # `dB` is no tenth of a byte
            assert parse_unit(prefix + symbol).factor == plain.factor * Fraction(10) ** power


def test_no_prefixed_symbol_has_two_meanings() -> None:
    spelled: dict[str, str] = {}
    for prefix in PREFIXES:
        for symbol in PREFIXABLE:
            text = prefix + symbol
            assert text not in spelled, f"{text}: {spelled[text]} and {prefix}-{symbol}"
            spelled[text] = f"{prefix}-{symbol}"


@given(st.floats(min_value=-200, max_value=200))
def test_levels_and_powers_are_inverse(level: float) -> None:
    power = parse_quantity(f"{level:.12f} dBm").into(parse_unit("W"))
    assert float(Quantity(power, parse_unit("W")).into(parse_unit("dBm"))) == pytest.approx(
        level, abs=1e-9
    )


@given(st.floats(min_value=-150, max_value=150))
def test_ten_decibels_more_are_ten_times_the_power(level: float) -> None:
    low, high = (
        float(parse_quantity(f"{x:.9f} dBm").into(parse_unit("mW"))) for x in (level, level + 10)
    )
    assert high == pytest.approx(10 * low, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "unit", "number"),
    [
        ("100 ms", "s", 0.1),
        ("26 dBm", "mW", 398.1071705534973),
        ("400 mW", "dBm", 26.020599913279625),
        ("0 dBW", "dBm", 30.0),
        ("5.9 GHz", "Hz", 5.9e9),
        ("30 km/h", "m/s", 30 / 3.6),
        ("180 deg", "rad", math.pi),
        ("10°", "deg", 10.0),
        ("6 Mbit/s", "bit/s", 6e6),
        ("1 kB", "bit", 8000.0),
        ("0.4 dB/m", "dB/km", 400.0),
        ("50 %", "1", 0.5),
        ("20 degC", "K", 293.15),
        ("2 W/(m2.K)", "mW/(m^2*K)", 2000.0),
        ("3 1/s", "Hz", 3.0),
        ("9.81 m.s-2", "m/s^2", 9.81),
        ("-3.5e-1m", "cm", -35.0),
        ("7 µs", "ns", 7000.0),
        (".5", "1", 0.5),
    ],
)
def test_quantities_are_converted_and_rounded_once(written: str, unit: str, number: float) -> None:
    assert float(parse_quantity(written).into(parse_unit(unit))) == number


@pytest.mark.parametrize(
    ("written", "unit", "message"),
    [
        ("26 m", "dBm", r"expected a power \(dBm\), got a length \(m\)"),
        ("3 dB", "1", r"expected a pure number, got a gain or loss \(dB\)"),
        ("6 Mbit/s", "Hz", r"expected a frequency \(Hz\), got a data rate \(Mbit/s\)"),
        ("1 kg.m-3", "m", r"got a quantity in kg\.m-3"),
        ("5 mhz", "Hz", r"`mhz` is not a unit; did you mean `MHz`\?"),
        ("5 sec", "s", r"`sec` is not a unit; did you mean `s`\?"),
        ("30 kph", "m/s", r"did you mean `km/h`\?"),
        ("5 kdBm", "W", r"`kdBm` is not a unit"),
        ("1 m/s/s", "m/s2", r"more than one `/`; write m/\(s\.s\)"),
        ("1 W/m2.K", "1", "in parentheses"),
        ("1 dBm/m", "1", "a level such as dBm cannot be part of another unit"),
        ("0 W", "dBm", "0 W has no level in dBm; it must be positive"),
        ("-1 mW", "dBm", "must be positive"),
        ("99999 dBm", "W", "too large a power"),
        ("fast", "m/s", "`fast` is not a number with a unit"),
        ("1e999 m", "m", "out of range"),
        ("1e9999999999 m", "m", "out of range"),
        ("1" * 5000, "1", "is not a number with a unit"),
        ("5 (m", "m", "is not a unit"),
        ("12:30", "s", "is not a unit"),
    ],
)
def test_errors_name_both_quantities_or_a_unit_that_exists(
    written: str, unit: str, message: str
) -> None:
    with pytest.raises(UnitError, match=message):
        parse_quantity(written).into(parse_unit(unit))


@given(st.integers(min_value=-(2**62), max_value=2**62))
def test_durations_keep_every_nanosecond(time: int) -> None:
    assert duration(f"{time} ns") == time
    assert duration(format_duration(time)) == time


@given(st.integers(min_value=0, max_value=10**9))
def test_a_plain_number_of_seconds_means_the_decimal_that_was_written(milliseconds: int) -> None:
    assert duration(milliseconds / 1000) == milliseconds * 10**6


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("0.3 ns", "0.3 ns is not a whole number of nanoseconds"),
        (1e-10, "1e-10 s is not a whole number of nanoseconds"),
        ("20", "`20` has no unit; write `20 s`"),
        ("3 m", r"expected a time \(s\), got a length \(m\)"),
        (1e300, "is longer than 292 years"),
        (10**400, "is longer than 292 years"),
        ("-1e10 s", "is longer than 292 years"),
        (math.inf, "expected a time such as `50 ms`, got inf"),
    ],
)
def test_durations_are_never_rounded_nor_beyond_64_bits(written: str | float, message: str) -> None:
    with pytest.raises(UnitError, match=message):
        duration(written)
