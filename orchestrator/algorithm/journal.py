"""Where the steps of one component are written down, so that they can be made again."""

import abc

from orchestrator.algorithm.pieces import Piece


class Journal(abc.ABC):
    """Takes what a component was asked to do, in this order."""

    @abc.abstractmethod
    def note(self, piece: Piece) -> None:
        """Write down a step that begins."""

    @abc.abstractmethod
    def mark(self) -> int:
        """The component was saved here; what was noted before an earlier mark stays."""

    @abc.abstractmethod
    def return_to(self, mark: int) -> None:
        """The component returned to what was saved at `mark`: what was noted since is void."""
