"""Benchmarks: how fast the units are, beside what people use today.

`nlosim bench` finds them through the entry points `orchestrator.benchmarks`; each is a subclass of
`benchmarks.benchmark.Benchmark`. The other packages do not know this one.
"""
