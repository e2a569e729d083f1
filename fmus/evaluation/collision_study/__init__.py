"""The driving campaign: collision rate against packet error rate, the paper's Figures 9 and 10."""

from fmus.evaluation.collision_study.report import CollisionStudy as CollisionStudy
