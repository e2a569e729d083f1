"""Driving policies of the ego vehicle."""

from fmus.policy.component import Blind as Blind, RuleBased as RuleBased
from fmus.policy.expert import Expert as Expert, ExpertDriver as ExpertDriver
from fmus.policy.network import Network as Network
