"""What all comparisons with golden data have in common."""

import abc

from studies.verification.channel.comparison import Comparison
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import Tolerance


class Check(abc.ABC):
    """Golden data that were read and found well-formed, ready to be compared."""

    @property
    @abc.abstractmethod
    def tolerance(self) -> Tolerance:
        """Of what the file is mainly about."""

    @property
    @abc.abstractmethod
    def work(self) -> int:
        """How often `run` reports progress."""

    @abc.abstractmethod
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        """Give the inputs to the channel and compare its outputs.

        Raises:
            ComponentError: the channel failed.
        """
