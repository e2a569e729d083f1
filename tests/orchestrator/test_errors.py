"""What is caught where code of others is called, and what is said of it."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest
from typing_extensions import override

from orchestrator.blame import blamed
from orchestrator.errors import CosimError, PluginError, defects, in_words


class Panic(BaseException):
    """No `Exception`, as libraries in Rust raise it."""


class WordlessError(Exception):
    @override
    def __str__(self) -> str:
        raise self


@contextmanager
def _asking(expected: tuple[type[BaseException], ...]) -> Iterator[None]:
    try:
        yield
    finally:
        assert defects() == expected


@pytest.mark.parametrize("kind", [ValueError, SystemExit, GeneratorExit, Panic, WordlessError])
def test_whatever_code_of_others_raises_is_caught(kind: type[BaseException]) -> None:
    with pytest.raises(PluginError) as caught, blamed("the unit"):
        raise kind
    assert str(caught.value).startswith(f"the unit failed: {kind.__name__}")
    assert isinstance(caught.value.__cause__, kind)
    assert caught.value.where.startswith(f"{__file__}:")


@pytest.mark.parametrize("kind", [KeyboardInterrupt, CosimError, OSError, ZeroDivisionError])
def test_ctrl_c_and_what_says_itself_what_is_wrong_pass(kind: type[BaseException]) -> None:
    with pytest.raises(kind), blamed("the unit", says=(ZeroDivisionError,)):
        raise kind


def test_nothing_is_to_be_caught_where_nothing_was_raised_but_an_interruption() -> None:
    assert defects() == (BaseException,)
    for error, caught in ((KeyboardInterrupt(), ()), (ValueError(), (BaseException,))):
        with suppress(BaseException), _asking(caught):
            raise error


def test_an_error_is_told_by_type_and_message() -> None:
    assert in_words(LookupError("no such car")) == "LookupError: no such car"
    assert in_words(LookupError()) == "LookupError"
    said = "WordlessError, which cannot say what is wrong: its `__str__` fails"
    assert in_words(WordlessError("unheard")) == said
