"""`nlosim bench importer`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.importer import ecos, omsimulator
from benchmarks.importer.chain import Chain
from benchmarks.importer.ecos import EcosRun
from benchmarks.importer.floor import FloorRun
from benchmarks.importer.fmpy_loop import FmpyRun
from benchmarks.importer.matrix import MatrixRun
from benchmarks.importer.omsimulator import OmsimulatorRun
from benchmarks.importer.ours import OursRun
from benchmarks.settings import whole_number
from benchmarks.spread import Spread
from fmus.native.targets import compiler_command, select_targets

CHAINS: Final = tuple(
    Chain(kind, version, length)
    for kind in ("gain", "feedthrough")
    for version in (2, 3)
    for length in (2, 10, 50)
)
SIDE: Final = 500
"""Rows and columns of the matrix."""

OURS: Final = "nlosim"
PEERS: Final[Mapping[str, str]] = {
    "fmpy": "FMPy, prepared calls",
    "fmpy-methods": "FMPy, methods",
    "ecos": "ecos",
    "omsimulator": "OMSimulator",
    "python": "our Python path",
    "c": "C loop",
    "c-apart": "C loop, a library for each instance",
}
"""What the participants are called in rows; the keys end the names of their cases."""

TARGET_US: Final = 0.25
"""What is aimed at for a step of a Gain FMU, recording included [us]."""

_STEPS: Final = "steps"
_UNIT: Final = "us / FMU step"
_Measured: TypeAlias = Mapping[str, Sequence[Measurement]]


class ImporterBenchmark(Benchmark):
    """Chains of trivial FMUs in several importers, and a matrix in ours."""

    def __init__(self) -> None:
        self._steps = 10_000

    @property
    @override
    def description(self) -> str:
        return (
            "chains of 2, 10 and 50 FMUs that cost next to nothing, every output recorded: CPU "
            "microseconds per step of one FMU, set-up excluded"
        )

    @property
    @override
    def peer(self) -> str:
        absent = {"ecos": ecos.WHY_NOT, "OMSimulator": omsimulator.WHY_NOT}
        missing = "".join(f"; left out: {name} ({why})" for name, why in absent.items() if why)
        return (
            "the same FMUs, measured in turn, last values compared: FMPy in a loop of Python "
            "with lists, a bare C loop with an array, ecos (FMI 2.0) and OMSimulator (both with a "
            f"CSV file, values exchanged after all have stepped), and our Python path{missing}"
        )

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return {_STEPS: str(self._steps)}

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        self._steps = whole_number(settings, _STEPS, 100)

    @override
    def require(self) -> None:
        compiler_command(select_targets(["host"])[0], [])  # raises where there is no compiler

    @override
    def cases(self) -> Mapping[str, Case]:
        steps = self._steps
        found: dict[str, Case] = {}
        for chain in CHAINS:
            found[f"{chain.name}/{OURS}"] = OursRun(chain=chain, steps=steps, compiled=True)
            found[f"{chain.name}/c"] = FloorRun(chain=chain, steps=steps)
            found[f"{chain.name}/c-apart"] = FloorRun(chain=chain, steps=steps, is_shared=False)
            found[f"{chain.name}/fmpy"] = FmpyRun(chain=chain, steps=steps, prepared=True)
            found[f"{chain.name}/fmpy-methods"] = FmpyRun(chain=chain, steps=steps, prepared=False)
            if chain.version == 2 and not ecos.WHY_NOT:
                found[f"{chain.name}/ecos"] = EcosRun(chain=chain, steps=steps)
            if not omsimulator.WHY_NOT:
                found[f"{chain.name}/omsimulator"] = OmsimulatorRun(chain=chain, steps=steps)
            few = max(steps // 10, 100)
            found[f"{chain.name}/python"] = OursRun(chain=chain, steps=few, compiled=False)
        found[f"matrix/{SIDE}x{SIDE}"] = MatrixRun(side=SIDE, steps=max(steps // 20, 100))
        return found

    @override
    def rows(self, measured: _Measured) -> Sequence[Row]:
        found = [row for chain in CHAINS for row in _rows(chain, measured)]
        matrix = measured.get(f"matrix/{SIDE}x{SIDE}")
        return [*found, *(_matrix(matrix) if matrix else [])]


def _rows(chain: Chain, measured: _Measured) -> Iterator[Row]:
    """Ours beside each peer that was measured, or alone."""
    ours = measured.get(f"{chain.name}/{OURS}")
    if not ours:
        return
    spread = Spread.of(each["step_us"] for each in ours)
    details = {"recording_us": Spread.of(each["recording_us"] for each in ours).median}
    if chain.kind == "gain":
        details["target_us"] = TARGET_US
    peers = [case for case in PEERS if f"{chain.name}/{case}" in measured]
    if not peers:
        yield Row.of(chain.name, spread, _UNIT, is_higher_better=False, details=details)
    for case in peers:
        peer = Spread.of(each["step_us"] for each in measured[f"{chain.name}/{case}"])
        yield Row.of(
            f"{chain.name}/{case}",
            spread,
            _UNIT,
            peer=peer.median,
            peer_name=PEERS[case],
            is_higher_better=False,
            details={"peer_low_us": peer.low, "peer_high_us": peer.high, **details},
        )


def _matrix(runs: Sequence[Measurement]) -> Iterator[Row]:
    spread = Spread.of(run["step_us"] for run in runs)
    peers = (
        ("floor_us", "C loop"), ("numpy_us", "one numpy.copyto"), ("memcpy_us", "one memcpy")
    )  # fmt: skip
    for key, name in peers:
        copy = Spread.of(run[key] for run in runs)
        yield Row.of(
            f"matrix/{SIDE}x{SIDE}/{key.removesuffix('_us')}",
            spread,
            "us / step of both",
            peer=copy.median,
            peer_name=name,
            is_higher_better=False,
            details={"peer_low_us": copy.low, "peer_high_us": copy.high},
        )
