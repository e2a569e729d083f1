"""Physics that several Python units, studies and checks share; every formula stands here once.

The native units have the same formulas in C, and tests compare the two. What checks our models from
outside (`tests/`: brute force, references) has its own, on purpose; so have `adapters`, which know
no unit.
"""
