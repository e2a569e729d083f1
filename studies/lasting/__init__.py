"""Collisions where the obstruction lasts through the decision: Figures 9 and 10 once more."""

from studies.lasting.report import LastingStudy as LastingStudy
