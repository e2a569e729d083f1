"""Driving policies of the ego vehicle."""

from fmus.driving.policy.expert import Expert as Expert, ExpertDriver as ExpertDriver
from fmus.driving.policy.network import Network as Network
from fmus.driving.policy.rule_based import Blind as Blind, RuleBased as RuleBased
