"""What is wrong with golden data."""

from collections.abc import Sequence

from orchestrator.errors import CosimError


class GoldenError(CosimError):
    """Golden data cannot be used. Who made them can fix it. Exit code 2.

    Attributes:
        problems: one sentence each, `FILE: PLACE: what is wrong`.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)
