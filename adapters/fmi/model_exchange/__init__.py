"""Model Exchange: an FMU that tells derivatives, and a solver that integrates them.

`instance` makes of such an FMU one that can be stepped, like one for Co-Simulation; everything else
of the importer sees no difference.
"""
