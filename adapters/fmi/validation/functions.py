"""The functions that the binary of an FMU has to export."""

from collections.abc import Iterable
from typing import Final

from adapters.fmi.exports import exported

_TYPES2: Final = ("Real", "Integer", "Boolean", "String")
_TYPES3: Final = (
    "Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64",
    "Boolean", "String", "Binary", "Clock",
)  # fmt: skip
_COMMON: Final = (
    "GetVersion", "SetDebugLogging", "FreeInstance", "EnterInitializationMode",
    "ExitInitializationMode", "Terminate", "Reset",
)  # fmt: skip

_FUNCTIONS: Final = {
    (2, ""): (
        *_COMMON,
        "GetTypesPlatform",
        "Instantiate",
        "SetupExperiment",
        *(f"{verb}{type_}" for verb in ("Get", "Set") for type_ in _TYPES2),
        *(f"{verb}FMUstate" for verb in ("Get", "Set", "Free", "Serialize", "DeSerialize")),
        "SerializedFMUstateSize",
        "GetDirectionalDerivative",
    ),
    (2, "ModelExchange"): (
        "EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode",
        "CompletedIntegratorStep", "SetTime", "SetContinuousStates", "GetDerivatives",
        "GetEventIndicators", "GetContinuousStates", "GetNominalsOfContinuousStates",
    ),
    (2, "CoSimulation"): (
        "SetRealInputDerivatives", "GetRealOutputDerivatives", "DoStep", "CancelStep",
        *(f"Get{type_}Status" for type_ in _TYPES2), "GetStatus",
    ),
    (3, ""): (
        *_COMMON,
        *(f"{verb}{type_}" for verb in ("Get", "Set") for type_ in _TYPES3),
        "GetNumberOfVariableDependencies", "GetVariableDependencies",
        *(f"{verb}FMUState" for verb in ("Get", "Set", "Free", "Serialize", "Deserialize")),
        "SerializedFMUStateSize", "GetDirectionalDerivative", "GetAdjointDerivative",
        "EnterConfigurationMode", "ExitConfigurationMode", "EnterEventMode",
        *(f"{verb}Interval{kind}" for verb in ("Get", "Set") for kind in ("Decimal", "Fraction")),
        *(f"{verb}Shift{kind}" for verb in ("Get", "Set") for kind in ("Decimal", "Fraction")),
        "EvaluateDiscreteStates", "UpdateDiscreteStates",
    ),
    (3, "ModelExchange"): (
        "InstantiateModelExchange", "EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime",
        "SetContinuousStates", "GetContinuousStateDerivatives", "GetEventIndicators",
        "GetContinuousStates", "GetNominalsOfContinuousStates", "GetNumberOfEventIndicators",
        "GetNumberOfContinuousStates",
    ),
    (3, "CoSimulation"): (
        "InstantiateCoSimulation", "EnterStepMode", "GetOutputDerivatives", "DoStep",
    ),
    (3, "ScheduledExecution"): ("InstantiateScheduledExecution", "ActivateModelPartition"),
}  # fmt: skip


def required(version: int, kinds: Iterable[str]) -> tuple[str, ...]:
    """The names of all functions that an FMU exports, optional capabilities included.

    FMI 2.0.4, 2.1 and 3.0.2, 2.5: what a kind declares is there, also where it only says that a
    capability is missing.

    Args:
        version: 2 or 3.
        kinds: `ModelExchange`, `CoSimulation`, `ScheduledExecution`.
    """
    names = [*_FUNCTIONS[version, ""]]
    for kind in kinds:
        names += _FUNCTIONS.get((version, kind), ())
    return tuple(f"fmi{version}{name}" for name in names)


def missing(binary: bytes, version: int, kinds: Iterable[str]) -> tuple[str, ...]:
    """The required functions that a binary does not export.

    Raises:
        ExportsError: nobody can tell.
    """
    there = exported(binary)
    return tuple(name for name in required(version, kinds) if name not in there)
