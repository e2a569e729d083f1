"""The relay unit: which vehicle, if any, forwards the sharer's data to the ego.

For a policy of one's own: derive from `RelaySelection`, whose docstring says all that it takes; in
`choose` a `Situation` comes in and a `Choice` goes out.
"""

from fmus.relay.direct import Direct as Direct
from fmus.relay.expected_prr import ExpectedPrr as ExpectedPrr
from fmus.relay.forced import Forced as Forced
from fmus.relay.mohed import Mohed as Mohed
from fmus.relay.oracle import Oracle as Oracle
from fmus.relay.selection import RelaySelection as RelaySelection
from fmus.relay.signal_strength import SignalStrength as SignalStrength
from fmus.relay.situation import Choice as Choice, Situation as Situation
from fmus.relay.uniform import Random as Random
