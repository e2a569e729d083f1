"""A stored state of an FMU."""

from collections.abc import Mapping
from dataclasses import dataclass

from adapters.fmi.instance import FmuInstance
from orchestrator.signal import Signal, Signals


@dataclass(frozen=True, eq=False)
class FmuState:
    """A stored state of one instance, and what the importer knew then."""

    instance: FmuInstance
    address: int
    lengths: Mapping[str, int]
    written: Mapping[str, Signal]
    read: Signals
