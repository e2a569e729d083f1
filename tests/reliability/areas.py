"""The areas of the campaign, in the order of its table."""

from typing import Final

from tests.reliability.archives import ARCHIVES
from tests.reliability.area import Area
from tests.reliability.at_rest import AT_REST
from tests.reliability.environment import ENVIRONMENT
from tests.reliability.messages import MESSAGES
from tests.reliability.native import ENGINE, NATIVE
from tests.reliability.scenarios import SCENARIOS
from tests.reliability.signals import SIGNALS
from tests.reliability.soak import SOAK

AREAS: Final[tuple[Area, ...]] = (
    SCENARIOS,
    ARCHIVES,
    MESSAGES,
    AT_REST,
    NATIVE,
    ENGINE,
    SIGNALS,
    ENVIRONMENT,
    SOAK,
)
