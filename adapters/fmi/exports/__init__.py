"""The functions that shared libraries export, from their own tables: ELF, PE and Mach-O."""

from adapters.fmi.exports.read import ExportsError, exported

__all__ = ["ExportsError", "exported"]
