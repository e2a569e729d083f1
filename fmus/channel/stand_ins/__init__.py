"""Stand-ins for the channel FMU: constant packet error rate, and replay of recorded links.

They have its connectors, `probe.*` excepted, and take and give the same packets and receptions.

For a channel model of one's own: derive a component from `LinkModelComponent`, whose docstring says
all that it takes, and a model from `LinkModel`; in `judge` come a frame and its `Receivers`, and
`Verdicts` go out.
"""

from fmus.channel.stand_ins.component import LinkModelComponent as LinkModelComponent
from fmus.channel.stand_ins.constant_per import ConstantPer as ConstantPer
from fmus.channel.stand_ins.delivery import (
    LinkModel as LinkModel,
    Receivers as Receivers,
    Verdicts as Verdicts,
)
from fmus.channel.stand_ins.packets import Frame as Frame
from fmus.channel.stand_ins.parameters import RadioParameters as RadioParameters
from fmus.channel.stand_ins.philox import reception_draws as reception_draws
from fmus.channel.stand_ins.trace import Trace as Trace
