"""Driving policies of the ego vehicle."""

from fmus.policy.component import Blind as Blind, RuleBased as RuleBased
