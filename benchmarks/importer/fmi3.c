/* The models of `fmi2.c` behind the FMI 3.0 co-simulation interface, with more types.
 *
 * A variable has LENGTH elements. Input k of a type, counted from OFFSET_<type>, has the value reference
 * OFFSET + k, output k has that plus the number of them. */
#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"
#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define TYPES(X)       \
    X(Float32, float)  \
    X(Float64, double) \
    X(Int32, int32_t)  \
    X(Int64, int64_t)  \
    X(UInt8, uint8_t)  \
    X(Boolean, bool)

typedef struct {
#define FIELD(TYPE, type) fmi3##TYPE TYPE[(2 * N_##TYPE + 1) * LENGTH];
    TYPES(FIELD)
    int count;
} Model;

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                                fmi3Boolean early, const fmi3ValueReference r[], size_t n,
                                                fmi3InstanceEnvironment e, fmi3LogMessageCallback log,
                                                fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)r, (void)n;
    (void)e, (void)log, (void)update;
    return strcmp(token, TOKEN) == 0 ? calloc(1, sizeof(Model)) : NULL;
}
EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }
EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                              fmi3Boolean sd, fmi3Float64 stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi3OK;
}
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { memset(c, 0, sizeof(Model)); return fmi3OK; }
EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String k[]) {
    (void)c, (void)on, (void)n, (void)k;
    return fmi3OK;
}

#if LENGTH == 1
#define COPY(to, from) (to)[0] = (from)[0]
#else
#define COPY(to, from) memcpy(to, from, LENGTH * sizeof *(to))
#endif
#define DEFINE_ACCESS(TYPE, type)                                                                              \
    EXPORT fmi3Status fmi3Get##TYPE(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3##TYPE v[], size_t m) { \
        (void)m;                                                                                               \
        for (size_t i = 0; i < n; i++) COPY(v + i * LENGTH, ((Model *)c)->TYPE + (r[i] - OFFSET_##TYPE) * LENGTH); \
        return fmi3OK;                                                                                         \
    }                                                                                                          \
    EXPORT fmi3Status fmi3Set##TYPE(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3##TYPE v[], \
                                    size_t m) {                                                                \
        (void)m;                                                                                               \
        for (size_t i = 0; i < n; i++) COPY(((Model *)c)->TYPE + (r[i] - OFFSET_##TYPE) * LENGTH, v + i * LENGTH); \
        return fmi3OK;                                                                                         \
    }
TYPES(DEFINE_ACCESS)

/* One element of an array changes at a step of a source: what is measured is moving it. */
#define ADVANCE(TYPE, of_count, factor)                                                             \
    for (size_t k = 0; k < N_##TYPE; k++) {                                                         \
        fmi3##TYPE *in = m->TYPE + k * LENGTH, *out = m->TYPE + (N_##TYPE + k) * LENGTH;            \
        if (IS_SOURCE)                                                                              \
            out[m->count % LENGTH] = (fmi3##TYPE)(of_count);                                        \
        else if (LENGTH > 1)                                                                        \
            COPY(out, in);                                                                          \
        else                                                                                        \
            out[0] = (fmi3##TYPE)(in[0] factor);                                                    \
    }

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean keeps, fmi3Boolean *event,
                             fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last) {
    (void)keeps;
    Model *m = c;
    m->count++;
    ADVANCE(Float64, m->count * 0.001 * (double)(k + 1), *FACTOR)
    ADVANCE(Float32, m->count, )
    ADVANCE(Int32, m->count, )
    ADVANCE(Int64, m->count, )
    ADVANCE(UInt8, m->count, )
    ADVANCE(Boolean, m->count & 1, )
    *event = *end = *early = false;
    *last = t + h;
    return fmi3OK;
}

/* Importers look for these, and do not call them. */
#define UNUSED(name) EXPORT fmi3Status name(void) { return fmi3Error; }
UNUSED(fmi3ActivateModelPartition)
UNUSED(fmi3CompletedIntegratorStep)
UNUSED(fmi3DeserializeFMUState)
UNUSED(fmi3EnterConfigurationMode)
UNUSED(fmi3EnterContinuousTimeMode)
UNUSED(fmi3EnterEventMode)
UNUSED(fmi3EvaluateDiscreteStates)
UNUSED(fmi3ExitConfigurationMode)
UNUSED(fmi3FreeFMUState)
UNUSED(fmi3GetAdjointDerivative)
UNUSED(fmi3GetBinary)
UNUSED(fmi3GetClock)
UNUSED(fmi3GetContinuousStateDerivatives)
UNUSED(fmi3GetContinuousStates)
UNUSED(fmi3GetDirectionalDerivative)
UNUSED(fmi3GetEventIndicators)
UNUSED(fmi3GetFMUState)
UNUSED(fmi3GetInt16)
UNUSED(fmi3GetInt8)
UNUSED(fmi3GetIntervalDecimal)
UNUSED(fmi3GetIntervalFraction)
UNUSED(fmi3GetNominalsOfContinuousStates)
UNUSED(fmi3GetNumberOfContinuousStates)
UNUSED(fmi3GetNumberOfEventIndicators)
UNUSED(fmi3GetNumberOfVariableDependencies)
UNUSED(fmi3GetOutputDerivatives)
UNUSED(fmi3GetShiftDecimal)
UNUSED(fmi3GetShiftFraction)
UNUSED(fmi3GetString)
UNUSED(fmi3GetUInt16)
UNUSED(fmi3GetUInt32)
UNUSED(fmi3GetUInt64)
UNUSED(fmi3GetVariableDependencies)
EXPORT fmi3Instance fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT fmi3Instance fmi3InstantiateScheduledExecution(void) { return NULL; }
UNUSED(fmi3SerializeFMUState)
UNUSED(fmi3SerializedFMUStateSize)
UNUSED(fmi3SetBinary)
UNUSED(fmi3SetClock)
UNUSED(fmi3SetContinuousStates)
UNUSED(fmi3SetFMUState)
UNUSED(fmi3SetInt16)
UNUSED(fmi3SetInt8)
UNUSED(fmi3SetIntervalDecimal)
UNUSED(fmi3SetIntervalFraction)
UNUSED(fmi3SetShiftDecimal)
UNUSED(fmi3SetShiftFraction)
UNUSED(fmi3SetString)
UNUSED(fmi3SetTime)
UNUSED(fmi3SetUInt16)
UNUSED(fmi3SetUInt32)
UNUSED(fmi3SetUInt64)
UNUSED(fmi3UpdateDiscreteStates)
