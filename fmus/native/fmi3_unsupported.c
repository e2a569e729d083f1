/* FMI 3.0 functions that every binary must export and this one does not offer. The capability
 * flags in modelDescription.xml say so; who calls them all the same gets an error with a message. */
#include "fmi3_log.h"

/* The parameters are the standard's; none is looked at. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define UNSUPPORTED(NAME, ...)                                             \
    fmi3Status NAME(fmi3Instance c, __VA_ARGS__) {                         \
        return c ? refuse(c, #NAME, "not supported by this FMU") : fmi3Error; \
    }

#define REFERENCES const fmi3ValueReference r[], size_t n

UNSUPPORTED(fmi3GetString, REFERENCES, fmi3String v[], size_t m)
UNSUPPORTED(fmi3SetString, REFERENCES, const fmi3String v[], size_t m)
UNSUPPORTED(fmi3GetClock, REFERENCES, fmi3Clock v[])
UNSUPPORTED(fmi3SetClock, REFERENCES, const fmi3Clock v[])
UNSUPPORTED(fmi3GetIntervalDecimal, REFERENCES, fmi3Float64 i[], fmi3IntervalQualifier q[])
UNSUPPORTED(fmi3GetIntervalFraction, REFERENCES, fmi3UInt64 k[], fmi3UInt64 d[],
            fmi3IntervalQualifier q[])
UNSUPPORTED(fmi3GetShiftDecimal, REFERENCES, fmi3Float64 s[])
UNSUPPORTED(fmi3GetShiftFraction, REFERENCES, fmi3UInt64 k[], fmi3UInt64 d[])
UNSUPPORTED(fmi3SetIntervalDecimal, REFERENCES, const fmi3Float64 i[])
UNSUPPORTED(fmi3SetIntervalFraction, REFERENCES, const fmi3UInt64 k[], const fmi3UInt64 d[])
UNSUPPORTED(fmi3SetShiftDecimal, REFERENCES, const fmi3Float64 s[])
UNSUPPORTED(fmi3SetShiftFraction, REFERENCES, const fmi3UInt64 k[], const fmi3UInt64 d[])
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
UNSUPPORTED(fmi3GetVariableDependencies, fmi3ValueReference r, size_t e[],
            fmi3ValueReference i[], size_t f[], fmi3DependencyKind k[], size_t n)
UNSUPPORTED(fmi3GetDirectionalDerivative, REFERENCES, const fmi3ValueReference k[], size_t m,
            const fmi3Float64 seed[], size_t p, fmi3Float64 sensitivity[], size_t q)
UNSUPPORTED(fmi3GetAdjointDerivative, REFERENCES, const fmi3ValueReference k[], size_t m,
            const fmi3Float64 seed[], size_t p, fmi3Float64 sensitivity[], size_t q)
UNSUPPORTED(fmi3GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 v[],
            size_t m)
UNSUPPORTED(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 t)

/* ---- Model Exchange ------------------------------------------------------------------------ */

UNSUPPORTED(fmi3SetTime, fmi3Float64 t)
UNSUPPORTED(fmi3SetContinuousStates, const fmi3Float64 x[], size_t n)
UNSUPPORTED(fmi3GetContinuousStates, fmi3Float64 x[], size_t n)
UNSUPPORTED(fmi3GetContinuousStateDerivatives, fmi3Float64 x[], size_t n)
UNSUPPORTED(fmi3GetNominalsOfContinuousStates, fmi3Float64 x[], size_t n)
UNSUPPORTED(fmi3GetEventIndicators, fmi3Float64 z[], size_t n)
UNSUPPORTED(fmi3GetNumberOfEventIndicators, size_t *n)
UNSUPPORTED(fmi3GetNumberOfContinuousStates, size_t *n)
UNSUPPORTED(fmi3CompletedIntegratorStep, fmi3Boolean no_set, fmi3Boolean *event,
            fmi3Boolean *terminate)

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
    return c ? refuse(c, __func__, "not supported by this FMU") : fmi3Error;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    return c ? refuse(c, __func__, "not supported by this FMU") : fmi3Error;
}

static fmi3Instance refuse_instance(fmi3InstanceEnvironment environment,
                                    fmi3LogMessageCallback log, const char *function) {
    Instance nobody = {.environment = environment, .log = log};
    refuse(&nobody, function, "this FMU offers Co-Simulation only");
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    return refuse_instance(environment, log, __func__);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock) {
    return refuse_instance(environment, log, __func__);
}
