"""Fixtures of the tests of the orchestrator."""

from pathlib import Path

import pytest

from orchestrator import measure, registry, report
from orchestrator.experiment import report as experiment_report
from orchestrator.remote.protocol import Message
from tests.installation import install

SAMPLE_UNITS = {
    registry.COMPONENTS: {
        "sender": "sample_units:Sender",
        "receiver": "sample_units:Receiver",
        "alarm": "sample_units:Alarm",
        "carts": "sample_units:Carts",
        "broken": "sample_units:Broken",
        "counting": "array_units:Counting",
        "keeping": "array_units:Keeping",
        "road": "family_units:Road",
        "driver": "family_units:Driver",
    },
    measure.GROUP: {
        "span": "sample_units:Span",
        "clumsy": "sample_units:Clumsy",
        "leaving": "sample_units:Leaving",
        "course": "sample_units:Course",
        "no-measure": "sample_units:Trace",
    },
    report.GROUP: {"trace": "sample_units:Trace", "buggy": "sample_units:Buggy"},
    experiment_report.GROUP: {
        "tally": "experiment_reports:Tally",
        "refusing": "experiment_reports:Refusing",
        "careless": "experiment_reports:Careless",
        "faulty": "experiment_reports:Faulty",
        "misnamed": "sample_units:Trace",
    },
}


@pytest.fixture
def sample_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install the components and reports of `packages/sample_units.py`, and no others.

    The coupling algorithms are those that are installed.
    """
    monkeypatch.syspath_prepend(Path(__file__).parent / "packages")
    install(monkeypatch, SAMPLE_UNITS)


TWO_UNITS = """\
schema: 1
title: Two units
time: {start: 0 s, stop: 1 s}
seed: 7
coupling:
  algorithm: gauss-seidel
components:
  car:
    type: sender
    step: 50 ms
    parameters: {power: 400 mW, count: 2, noisy: true}
  base:
    type: receiver
    step: 100 ms
    process: on-request
    parameters:
      gain: 2
connections:
  - {from: car.vehicle, to: base.vehicle}
"""


@pytest.fixture
def scenario_file(tmp_path: Path, sample_units: None) -> Path:
    """A scenario of two units that can be run."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO_UNITS)
    return path


@pytest.fixture
def lengths(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Those of the messages that are decoded in this process."""
    found: list[int] = []
    decode = Message.decode

    def noting(message: bytes) -> tuple[Message, int]:
        found.append(len(message))
        return decode(message)

    monkeypatch.setattr(Message, "decode", noting)
    return found
