"""Who offers to relay: a share of the neighbours, the same ones whatever the policy."""

import numpy as np


class Offers:
    """Which vehicles offer to relay, each with the same probability, for the whole run.

    What a vehicle does follows from the component's stream and its number alone: all policies of
    one name and seed find the same vehicles willing, and a larger share only adds to them. No
    draw is taken from the policy's own generator.

    Args:
        share: of the vehicles, 0 to 1.
        rng: the component's generator as it was given to `setup`; it is not advanced.
    """

    def __init__(self, share: float, rng: np.random.Generator) -> None:
        self._share = share
        (own,) = rng.spawn(1)
        self._salt = int(own.integers(2**63))

    def __contains__(self, vehicle: int) -> bool:
        """Whether `vehicle`, a number of at least 0, offers to relay."""
        if self._share >= 1.0:
            return True
        drawn = np.random.default_rng((self._salt, vehicle)).random()
        return bool(drawn < self._share)
