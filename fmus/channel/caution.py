"""Values of the channel's parameters that bias what is counted in a recording."""

from typing import Final

from orchestrator.caution import Caution

UNNOTICED: Final = Caution(
    value=False,
    meaning="frames below the sensitivity are lost without a record, so ratios of receptions, "
    "such as the PRR of a class of links, are of noticed frames only, and too high",
)
