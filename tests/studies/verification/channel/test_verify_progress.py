"""The progress bar."""

import io
import itertools
import sys
from functools import partial

import pytest
from typing_extensions import override

from studies.verification.channel.check import Advance, Check
from studies.verification.channel.comparison import Comparison
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import LOSS
from studies.verification.channel.verification import GoldenSet, read_golden_set, verify

from .golden_sample import GOLDEN, SEEDS


class Terminal(io.StringIO):
    @override
    def isatty(self) -> bool:
        return True


class TwoSteps(Check):
    """Advances twice, and compares nothing."""

    @property
    @override
    def work(self) -> int:
        return 2

    @override
    def run(self, channel: ChannelUnderTest, advance: Advance) -> Comparison:
        advance()
        advance()
        return Comparison.of_values(LOSS, [], [])


@pytest.mark.slow
def test_every_check_advances_as_often_as_it_has_work(channel: ChannelUnderTest) -> None:
    for name, check in read_golden_set(GOLDEN, SEEDS).checks.items():
        steps = itertools.count()
        check.run(channel, partial(next, steps))
        assert next(steps) == check.work > 0, name


def shown_on(
    stream: io.StringIO, channel: ChannelUnderTest, monkeypatch: pytest.MonkeyPatch
) -> str:
    monkeypatch.setattr(sys, "stderr", stream)
    verify(channel, GoldenSet({"pathloss.csv": TwoSteps(tolerance=LOSS)}, {}))
    return stream.getvalue()


def test_the_bar_names_the_file_and_is_gone_in_the_end(
    channel: ChannelUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = shown_on(Terminal(), channel, monkeypatch)
    assert "pathloss.csv" in shown
    assert "/2 [" in shown
    assert shown.rstrip(" ").endswith("\r")


def test_there_is_a_bar_on_a_terminal_only(
    channel: ChannelUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert shown_on(io.StringIO(), channel, monkeypatch) == ""
