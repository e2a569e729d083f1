"""How sure a share that was counted is; the core's own statistics use the same interval."""

from orchestrator.intervals import wilson

__all__ = ["wilson"]
