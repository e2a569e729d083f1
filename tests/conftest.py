"""Settings of all tests."""

import signal

from hypothesis import settings

# No deadlines: CI machines are noisy. Derandomised: a failure in CI is a failure here.
settings.register_profile("ci", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("ci")

# Shells start jobs in the background with SIGINT ignored, which processes inherit; tests of Ctrl-C
# need it whoever started them.
signal.signal(signal.SIGINT, signal.default_int_handler)
