"""Whether route files are in the order in which SUMO reads them: by departure."""

from typing import Final

from adapters.sumo.checks.findings import Findings
from adapters.sumo.checks.options import time
from adapters.sumo.checks.reading import Attributes
from orchestrator.errors import Location
from orchestrator.timebase import Time, seconds

UNSORTED: Final = "departures that come too late in the file"
"""A kind of remarks: SUMO leaves out whoever stands behind one that departs later."""

_SINGLE: Final = frozenset({"vehicle", "trip", "person", "container"})
_SEVERAL: Final = frozenset({"flow", "personFlow", "containerFlow"})


class Departures:
    """Looks at the departures of one route file.

    SUMO reads such a file while it simulates, `route-steps` at a time, and never goes back. Words
    such as `triggered` are no times.

    Args:
        findings: where remarks go.
    """

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._latest: Time | None = None

    def note(self, name: str, user: str, attributes: Attributes, where: Location) -> None:
        """Look at an element called `name`; `user` is what messages call it."""
        if name not in _SINGLE | _SEVERAL:
            return
        departs = time(attributes.get("depart" if name in _SINGLE else "begin", ""))
        if departs is None:
            return
        if self._latest is None or departs >= self._latest:
            self._latest = departs
            return
        what = (
            f"{user} is left out by SUMO: it departs at {seconds(departs):g} s, and stands behind "
            f"one that departs at {seconds(self._latest):g} s; sort the file by departure"
        )
        self._findings.add(UNSORTED, where, what)
