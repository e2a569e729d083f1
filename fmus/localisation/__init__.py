"""The localisation unit: what vehicles believe of their own poses."""

from fmus.localisation.pose_errors import (
    Accuracy as Accuracy,
    Offsets as Offsets,
    PoseErrors as PoseErrors,
)
from fmus.localisation.stamping import stamped as stamped
from fmus.localisation.unit import Localisation as Localisation
