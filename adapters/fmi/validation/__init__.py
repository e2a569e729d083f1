"""What is wrong with an FMU: every broken rule of FMI 2.0.4 and 3.0.2, with its line."""

from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.validate import validate

__all__ = ["Finding", "validate"]
