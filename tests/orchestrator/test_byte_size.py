"""Amounts of memory are read as they are written, and written so that they are read."""

import pytest

from orchestrator.byte_size import format_size, parse_size, written_size


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("1 kB", 1000),
        ("512 MB", 512_000_000),
        (" 2GB ", 2_000_000_000),
        ("1 TB", 10**12),
        ("1 kiB", 1024),
        ("3 MiB", 3 * 1024**2),
        ("1.5 GiB", 1_610_612_736),
        (".5 TiB", 2**39),
        ("1.0005 kB", 1000),
    ],
)
def test_it_is_read(text: str, size: int) -> None:
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "5", "5 B", "-1 GB", "0 GB", "1e3 MB", "1 mB", "one GB", "."])
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"such as `512 MB` or `2 GiB`, got `"):
        parse_size(text)


@pytest.mark.parametrize("size", [1, 999, 1000, 1_234_567, 2**31, 2**40 + 1])
def test_what_is_written_is_read_as_the_same(size: int) -> None:
    assert parse_size(written_size(size)) == size


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (500, "0.5 kB"),
        (999_999, "1e+03 kB"),
        (1_000_000, "1 MB"),
        (2_012_345_678, "2.01 GB"),
        (10**12, "1 TB"),
    ],
)
def test_it_is_shown_to_three_digits(size: int, text: str) -> None:
    assert format_size(size) == text


@pytest.mark.parametrize(
    "text", ["512 MB", "2 GB", "3 MiB", "1536 MiB", "7 kB", "1 TiB", "0.001 kB"]
)
def test_whole_amounts_are_written_as_people_write_them(text: str) -> None:
    assert written_size(parse_size(text)) == text
