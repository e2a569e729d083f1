"""The driving campaign: collision rate against packet error rate, the paper's Figures 9 and 10."""

from studies.collision.report import CollisionStudy as CollisionStudy
