"""SUMO on machines without the libraries that only its window needs."""

from adapters.sumo.headless.libraries import LIBRARIES, import_libsumo, stand_in, with_stand_ins

__all__ = ["LIBRARIES", "import_libsumo", "stand_in", "with_stand_ins"]
