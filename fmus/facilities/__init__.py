"""The V2X facilities layer: which messages are sent, and what arrived."""

from fmus.facilities.always_on import AlwaysOnFacilities as AlwaysOnFacilities
from fmus.facilities.collective_perception import CpmFacilities as CpmFacilities
from fmus.facilities.demand_driven import Facilities as Facilities
