"""A component for tests of experiments, which run in processes of their own."""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from typing_extensions import override

from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time
from tests.orchestrator.packages.sample_units import Isolated


class Mortal(Isolated):
    """May take its process with it, as a fault in native code does."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        dies: bool = parameter(False, doc="whether the process ends in the first step")
        lines: int = parameter(0, doc="the first run of all ends after so many lines of `log`")
        log: str = parameter("", doc="an absolute path")

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._parameters.dies:
            os._exit(1)
        if self._parameters.lines:
            self._linger(Path(self._parameters.log))

    def _linger(self, log: Path) -> None:
        """Wait for other runs, but in one run only, and no longer than a minute."""
        try:
            log.with_name(f"{log.name}.awaited").touch(exist_ok=False)
        except FileExistsError:
            return
        patience = time.monotonic() + 60.0
        while log.read_text().count("\n") < self._parameters.lines and time.monotonic() < patience:
            time.sleep(0.02)
