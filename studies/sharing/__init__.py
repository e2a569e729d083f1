"""Whom to ask: how good the choice of sharers by matrices is, and what ways of sharing cost."""

from studies.sharing.report import SharingStudy as SharingStudy
