"""What goes wrong with SUMO."""

from orchestrator.errors import CosimError


class SumoError(CosimError):
    """SUMO cannot start, or cannot do what the scenario asks for."""
