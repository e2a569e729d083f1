"""`nlosim verify` finds its units."""

import argparse
import logging
from importlib.metadata import EntryPoint

import pytest

from fmus.common import verify_command
from fmus.common.verify_command import VERIFICATIONS, add_command


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser()
    add_command(top.add_subparsers())
    return top


def test_units_add_their_own_parsers() -> None:
    found = parser().parse_args(["verify", "channel", "--golden", "x"])
    assert found.execute.__module__ == "fmus.channel_verification.command"
    found = parser().parse_args(["verify", "perception"])
    assert found.execute.__module__ == "fmus.perception_verification.command"


def test_a_broken_unit_does_not_take_the_others_away(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def offers(*, group: str) -> list[EntryPoint]:
        assert group == VERIFICATIONS
        channel = "fmus.channel_verification.command:add_unit"
        return [
            EntryPoint("broken", "no.such.module:add_unit", group),
            EntryPoint("channel", channel, group),
        ]

    monkeypatch.setattr(verify_command, "entry_points", offers)
    with caplog.at_level(logging.WARNING):
        parser().parse_args(["verify", "channel", "--golden", "x"])
    assert "`verify broken` (no.such.module:add_unit) cannot be loaded" in caplog.text
