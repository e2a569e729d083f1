"""Stand-ins for the channel FMU: constant packet error rate, and replay of recorded links.

They have its connectors, `probe.*` excepted, and take and give the same packets and receptions.
"""

from fmus.channel.stand_ins.constant_per import ConstantPer as ConstantPer
from fmus.channel.stand_ins.trace import Trace as Trace
