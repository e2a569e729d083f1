"""The abstract perception matrix (APM) as NumPy arrays, as a message on the air, in a signal.

An APM is what a vehicle tells others about its perception: a grid of square cells around it,
aligned with its heading, and in each cell the number of sensor points that fell into it
("NLOS Dies Twice", section "Sensor Fusion Match & Trigger") or the share of its ground that is
seen. An optional second layer carries the height and the velocity of the highest object in each
cell (section "Relay Selection").

`fmus/perception/` computes these messages natively; everything else that reads or writes them
uses this package.
"""

from fmus.messages.apm.matrix import (
    HEIGHT_STEP as HEIGHT_STEP,
    VELOCITY_STEP as VELOCITY_STEP,
    Apm as Apm,
    Float as Float,
    Layer as Layer,
    layer_height as layer_height,
    layer_velocity as layer_velocity,
)
from fmus.messages.apm.message import (
    compressed_payload as compressed_payload,
    decode as decode,
    encode as encode,
    message_size as message_size,
    read_header as read_header,
    shifted as shifted,
)
from fmus.messages.apm.signal import join as join, split as split
