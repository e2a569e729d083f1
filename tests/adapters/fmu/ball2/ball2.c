/* The ball behind FMI 2.0 Model Exchange. */
#include "../ball/ball.h"
#include "fmi2Functions.h"

static void say(Ball *b, int status, const char *text) {
    const fmi2CallbackFunctions *callbacks = b->log;
    callbacks->logger(callbacks->componentEnvironment, "ball", (fmi2Status)status, "logStatusError", text);
}
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String k[]) {
    (void)c, (void)on, (void)n, (void)k;
    return fmi2OK;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)resources, (void)visible, (void)logging;
    if (type != fmi2ModelExchange || strcmp(guid, "{ball-test}") != 0) return NULL;
    Ball *b = calloc(1, sizeof *b);
    if (!b) return NULL;
    ball_start(b);
    b->say = say, b->log = (void *)callbacks;
    return b;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start, fmi2Boolean sd,
                               fmi2Real stop) {
    int status = ball_initialise(c, start, td ? tol : -1, sd ? stop : -1);
    ((Ball *)c)->mode = INSTANTIATED;
    return (fmi2Status)status;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (fmi2Status)ball_enter(c, INITIALISING, INSTANTIATED); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (fmi2Status)ball_enter(c, EVENT, INITIALISING); }
fmi2Status fmi2Terminate(fmi2Component c) { return (fmi2Status)ball_enter(c, OVER, CONTINUOUS); }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return fmi2Error; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    Ball *b = c;
    ball_compute(b);
    for (size_t i = 0; i < n; i++) v[i] = b->real[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    int status = OK;
    for (size_t i = 0; i < n && status == OK; i++) status = ball_set_real(c, r[i], v[i]);
    return (fmi2Status)status;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) v[i] = ((Ball *)c)->integer[r[i] - 100];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) ((Ball *)c)->integer[r[i] - 100] = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]) {
    (void)r;
    for (size_t i = 0; i < n; i++) v[i] = ((Ball *)c)->kick;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[]) {
    (void)r;
    return n ? (fmi2Status)ball_set_kick(c, v[0] != fmi2False) : fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) {
    (void)c, (void)r, (void)n, (void)v;
    return fmi2Error;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) {
    (void)c, (void)r, (void)n, (void)v;
    return fmi2Error;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    if (!*s) *s = malloc(sizeof(Ball));
    if (!*s) return fmi2Error;
    memcpy(*s, c, sizeof(Ball));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    memcpy(c, s, sizeof(Ball));
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
                                        const fmi2ValueReference k[], size_t m, const fmi2Real d[], fmi2Real e[]) {
    if (m != 1) return fmi2Error;
    for (size_t i = 0; i < n; i++)
        if (ball_derivative(c, u[i], k[0], d[0], &e[i]) != OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return (fmi2Status)ball_enter(c, EVENT, CONTINUOUS); }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return (fmi2Status)ball_enter(c, CONTINUOUS, EVENT); }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    Ball *b = c;
    if (b->mode != EVENT) return (fmi2Status)refuse(b, "discrete states were updated outside of event mode");
    info->newDiscreteStatesNeeded = ball_update(b);
    info->terminateSimulation = b->is_done;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = fmi2True;
    info->nextEventTimeDefined = ball_has_next(b);
    info->nextEventTime = ball_next(b);
    return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *over) {
    *event = ball_complete(c, no_set);
    *over = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { return (fmi2Status)ball_set_time(c, t); }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    return n == 2 ? (fmi2Status)ball_set_states(c, x) : fmi2Error;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    return n == 2 ? (fmi2Status)ball_rates(c, dx) : fmi2Error;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    if (n) z[0] = ((Ball *)c)->real[H];
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    if (n == 2) x[0] = ((Ball *)c)->real[H], x[1] = ((Ball *)c)->real[V];
    return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = 1;
    return fmi2OK;
}
