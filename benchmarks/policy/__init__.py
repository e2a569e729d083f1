"""The driving network: a step of the policy, and the closed loop around it."""

from benchmarks.policy.benchmark import PolicyBenchmark as PolicyBenchmark
