/* T dx/dt = u - x behind the FMI 2.0 co-simulation interface; written for the tests. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "misbehave.h"

typedef struct {
    fmi2Real time_constant, fail_at, u, x, stop, tolerance, t;
    fmi2Integer fail_as, count, method;
    fmi2Boolean flag, rollback, terminated;
    const fmi2CallbackFunctions *callbacks;
} Lag;

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String k[]) {
    (void)c, (void)on, (void)n, (void)k;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)resources, (void)visible;
    if (type != fmi2CoSimulation || strcmp(guid, "{lag2-test}") != 0) return NULL;
    Lag *lag = callbacks->allocateMemory(1, sizeof *lag);
    if (!lag) return NULL;
    *lag = (Lag){.time_constant = 2, .fail_at = 1e9, .fail_as = 3, .count = 7,
                 .method = 1, .x = 1, .callbacks = callbacks};
    if (logging) callbacks->logger(callbacks->componentEnvironment, name, fmi2OK, "logAll", "it begins");
    return lag;
}
void fmi2FreeInstance(fmi2Component c) {
    Lag *lag = c;
    if (lag) lag->callbacks->freeMemory(lag);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start,
                               fmi2Boolean sd, fmi2Real stop) {
    Lag *lag = c;
    lag->t = start;
    lag->stop = sd ? stop : -1;
    lag->tolerance = td ? tol : -1;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return fmi2Error; }

static fmi2Real *real(Lag *lag, fmi2ValueReference r) {
    fmi2Real *fields[] = {&lag->time_constant, &lag->fail_at, &lag->u, &lag->x, &lag->stop, &lag->tolerance};
    return r < 6 ? fields[r] : NULL;
}
static fmi2Integer *integer(Lag *lag, fmi2ValueReference r) {
    fmi2Integer *fields[] = {&lag->fail_as, &lag->count, &lag->count, &lag->method};
    return r < 4 ? fields[r] : NULL;
}
/* Get and set variables of a type, of which `at` finds one. */
#define DEFINE_ACCESS(TYPE, at)                                                               \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n,         \
                             fmi2##TYPE v[]) {                                                \
        for (size_t i = 0; i < n; i++) v[i] = *at(c, r[i]);                                   \
        return fmi2OK;                                                                        \
    }                                                                                         \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n,         \
                             const fmi2##TYPE v[]) {                                          \
        for (size_t i = 0; i < n; i++) *at(c, r[i]) = v[i];                                   \
        return fmi2OK;                                                                        \
    }
DEFINE_ACCESS(Real, real)
DEFINE_ACCESS(Integer, integer)
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]) {
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 2 ? ((Lag *)c)->rollback : ((Lag *)c)->flag;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n,
                          const fmi2Boolean v[]) {
    (void)r;
    for (size_t i = 0; i < n; i++) ((Lag *)c)->flag = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) {
    (void)c, (void)r;
    for (size_t i = 0; i < n; i++) v[i] = "lag";
    return fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n,
                         const fmi2String v[]) {
    (void)c, (void)r, (void)n, (void)v;
    return fmi2Error;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    if (!*s) *s = malloc(sizeof(Lag));
    if (!*s) return fmi2Error;
    memcpy(*s, c, sizeof(Lag));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    memcpy(c, s, sizeof(Lag));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) {
    (void)c;
    free(*s);
    *s = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) {
    (void)c, (void)s, (void)n;
    return fmi2Error;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) {
    (void)c, (void)s, (void)b, (void)n;
    return fmi2Error;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) {
    (void)c, (void)b, (void)n, (void)s;
    return fmi2Error;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t n,
                                        const fmi2ValueReference k[], size_t m, const fmi2Real d[],
                                        fmi2Real e[]) {
    (void)c, (void)u, (void)n, (void)k, (void)m, (void)d, (void)e;
    return fmi2Error;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer o[], const fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                        const fmi2Integer o[], fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}

static fmi2Status advance(Lag *lag, fmi2Real t, fmi2Real h) {
    fmi2Real rate = h / lag->time_constant;
    lag->x = lag->u + (lag->x - lag->u) * (lag->method == 5 ? 1 - rate : exp(-rate));
    lag->t = t + h;
    return fmi2OK;
}
/* A step behind `fail_at`, see misbehave.h. */
static fmi2Status discard(Lag *lag, fmi2Real t, fmi2Real h) {
    fmi2Boolean is_behind = t >= lag->fail_at;
    if (lag->fail_as == ONLY_SHORT && h > SHORT) return fmi2Discard;
    if (lag->fail_as == ONLY_SHORT || (lag->fail_as == PAUSES && is_behind)) return advance(lag, t, h);
    lag->terminated = lag->fail_as != PAUSES;
    advance(lag, t, lag->fail_as == ENDS_BEHIND ? h : lag->fail_at - t);
    return fmi2Discard;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Lag *lag = c;
    if (t + h > lag->fail_at && lag->fail_as >= ENDS_WITHIN) return discard(lag, t, h);
    if (t + h > lag->fail_at && lag->fail_as > fmi2Pending) misbehave(lag->fail_as);
    else if (t + h > lag->fail_at) {
        lag->callbacks->logger(lag->callbacks->componentEnvironment, "lag", lag->fail_as,
                               "logStatusError", "told to fail as %d at %s", lag->fail_as, "once");
        return lag->fail_as;
    }
    lag->rollback = !no_set_state;
    return advance(lag, t, h);
}
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *v) {
    (void)c, (void)k, (void)v;
    return fmi2Discard;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real *v) {
    (void)k;
    *v = ((Lag *)c)->t;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *v) {
    (void)c, (void)k, (void)v;
    return fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v) {
    (void)k;
    *v = ((Lag *)c)->terminated;
    return fmi2OK;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *v) {
    (void)c, (void)k, (void)v;
    return fmi2Discard;
}
