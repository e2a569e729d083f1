"""Driving policies of the ego vehicle."""

from fmus.policy.expert import Expert as Expert, ExpertDriver as ExpertDriver
from fmus.policy.network import Network as Network
from fmus.policy.rule_based import Blind as Blind, RuleBased as RuleBased
