"""Components that write files of their own, beside the recording."""

import abc
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from orchestrator.component import Component


class FileWritingComponent(Component):
    """A component that writes files of its own during a run."""

    @classmethod
    @abc.abstractmethod
    def output_files(cls, parameters: Any) -> Iterable[Path]:
        """The files that an instance with these parameters writes.

        Args:
            parameters: an instance of the class's `Parameters`.

        Returns:
            Absolute paths, and relative ones of files in the directory of the run.
        """

    @abc.abstractmethod
    def write_into(self, directory: Path) -> None:
        """Take note of the directory of the run, which exists; called before `setup`."""
