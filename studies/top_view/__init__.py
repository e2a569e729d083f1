"""The top view on the page of a run: who is where, who hears whom, who sees what."""

from studies.top_view.layer import TopView

__all__ = ["TopView"]
