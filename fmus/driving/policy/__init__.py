"""Driving policies of the ego vehicle.

For a policy of one's own: derive from `DrivingPolicy`, whose docstring says all that it takes; in
`drive` come `Inputs`, of which `EGO` names those about the ego vehicle, and a `Command` goes out.
`follow` steers along the route.
"""

from fmus.driving.policy.base import DrivingPolicy as DrivingPolicy
from fmus.driving.policy.command import Command as Command, Hazard as Hazard
from fmus.driving.policy.connectors import EGO as EGO
from fmus.driving.policy.expert import Expert as Expert, ExpertDriver as ExpertDriver
from fmus.driving.policy.inputs import Inputs as Inputs
from fmus.driving.policy.network import Network as Network
from fmus.driving.policy.rule_based import Blind as Blind, RuleBased as RuleBased
from fmus.driving.policy.steering import SteeringParameters as SteeringParameters, follow as follow
