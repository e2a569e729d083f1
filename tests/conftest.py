"""Settings of all tests."""

from hypothesis import settings

# No deadlines: CI machines are noisy. Derandomised: a failure in CI is a failure here.
settings.register_profile("ci", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("ci")
