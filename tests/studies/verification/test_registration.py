"""`nlosim verify` finds its units."""

import argparse
import logging
from importlib.metadata import EntryPoint

import pytest

from studies.verification import command as verify_command
from studies.verification.command import VERIFICATIONS, add_command


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser()
    add_command(top.add_subparsers())
    return top


def test_units_add_their_own_parsers() -> None:
    found = parser().parse_args(["verify", "channel", "--golden", "x"])
    assert found.execute.__module__ == "studies.verification.channel.command"
    found = parser().parse_args(["verify", "perception"])
    assert found.execute.__module__ == "studies.verification.perception.command"


def test_a_broken_unit_does_not_take_the_others_away(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def offers(*, group: str) -> list[EntryPoint]:
        assert group == VERIFICATIONS
        channel = "studies.verification.channel.command:add_unit"
        return [
            EntryPoint("broken", "no.such.module:add_unit", group),
            EntryPoint("channel", channel, group),
        ]

    monkeypatch.setattr(verify_command, "entry_points", offers)
    with caplog.at_level(logging.WARNING):
        parser().parse_args(["verify", "channel", "--golden", "x"])
    assert "`verify broken` (no.such.module:add_unit) cannot be loaded" in caplog.text
