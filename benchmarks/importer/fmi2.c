/* Two models behind the FMI 2.0 co-simulation interface that cost next to nothing by themselves.
 *
 * `model.h` says how many variables of each type there are. A source counts its steps, and its outputs follow the count;
 * any other model gives its inputs on at each step, times FACTOR. Input k of a type has the value reference k, output k
 * has that plus the number of them. */
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef struct {
    fmi2Real real[2 * N_REAL + 1];
    fmi2Integer integer[2 * N_INTEGER + 1];
    fmi2Boolean boolean[2 * N_BOOLEAN + 1];
    int count;
} Model;

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                     fmi2Boolean logging) {
    (void)name, (void)resources, (void)callbacks, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || strcmp(guid, TOKEN) != 0) return NULL;
    return calloc(1, sizeof(Model));
}
EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start,
                                      fmi2Boolean sd, fmi2Real stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi2OK;
}
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { memset(c, 0, sizeof(Model)); return fmi2OK; }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String k[]) {
    (void)c, (void)on, (void)n, (void)k;
    return fmi2OK;
}

#define DEFINE_ACCESS(TYPE, field)                                                                        \
    EXPORT fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2##TYPE v[]) { \
        for (size_t i = 0; i < n; i++) v[i] = ((Model *)c)->field[r[i]];                                  \
        return fmi2OK;                                                                                    \
    }                                                                                                     \
    EXPORT fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n,              \
                                    const fmi2##TYPE v[]) {                                               \
        for (size_t i = 0; i < n; i++) ((Model *)c)->field[r[i]] = v[i];                                  \
        return fmi2OK;                                                                                    \
    }
DEFINE_ACCESS(Real, real)
DEFINE_ACCESS(Integer, integer)
DEFINE_ACCESS(Boolean, boolean)

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    (void)t, (void)h, (void)no_set_state;
    Model *m = c;
    m->count++;
    for (int k = 0; k < N_REAL; k++)
        m->real[N_REAL + k] = IS_SOURCE ? m->count * 0.001 * (k + 1) : FACTOR * m->real[k];
    for (int k = 0; k < N_INTEGER; k++) m->integer[N_INTEGER + k] = IS_SOURCE ? m->count : m->integer[k];
    for (int k = 0; k < N_BOOLEAN; k++) m->boolean[N_BOOLEAN + k] = IS_SOURCE ? m->count & 1 : m->boolean[k];
    return fmi2OK;
}

/* Importers look for these, and do not call them. */
#define UNUSED(name) EXPORT fmi2Status name(void) { return fmi2Error; }
UNUSED(fmi2GetString)
UNUSED(fmi2SetString)
UNUSED(fmi2GetFMUstate)
UNUSED(fmi2SetFMUstate)
UNUSED(fmi2FreeFMUstate)
UNUSED(fmi2SerializedFMUstateSize)
UNUSED(fmi2SerializeFMUstate)
UNUSED(fmi2DeSerializeFMUstate)
UNUSED(fmi2GetDirectionalDerivative)
UNUSED(fmi2SetRealInputDerivatives)
UNUSED(fmi2GetRealOutputDerivatives)
UNUSED(fmi2CancelStep)
UNUSED(fmi2GetStatus)
UNUSED(fmi2GetRealStatus)
UNUSED(fmi2GetIntegerStatus)
UNUSED(fmi2GetBooleanStatus)
UNUSED(fmi2GetStringStatus)
