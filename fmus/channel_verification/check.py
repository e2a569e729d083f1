"""What all comparisons with golden data have in common."""

import abc

from fmus.channel_verification.comparison import Comparison
from fmus.channel_verification.progress import Progress
from fmus.channel_verification.session import ChannelUnderTest
from fmus.channel_verification.tolerances import Tolerance


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
