"""FMUs as components, by FMPy."""

from adapters.fmi.component_type import FmuComponentType

__all__ = ["FmuComponentType"]
