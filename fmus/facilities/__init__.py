"""The V2X facilities layer: which messages are sent, and what arrived."""

from fmus.facilities.component import Facilities as Facilities
