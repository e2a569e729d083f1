/* The ball behind FMI 3.0 Model Exchange. */
#include "../ball/ball.h"
#include "fmi3Functions.h"

static void say(Ball *b, int status, const char *text) {
    ((fmi3LogMessageCallback)b->log)(b->environment, (fmi3Status)status, "logStatusError", text);
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    (void)name, (void)resources, (void)visible, (void)logging;
    if (strcmp(token, "{ball-test}") != 0) return NULL;
    Ball *b = calloc(1, sizeof *b);
    if (!b) return NULL;
    ball_start(b);
    b->say = say, b->log = (void *)log, b->environment = environment;
    return b;
}
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)environment, (void)log, (void)update;
    return NULL;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)c, (void)t, (void)h, (void)no_set_state, (void)event, (void)terminate, (void)early_return, (void)last;
    return fmi3Error;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    return (fmi3Status)ball_initialise(c, start, td ? tol : -1, sd ? stop : -1);
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return (fmi3Status)ball_enter(c, EVENT, INITIALISING); }
fmi3Status fmi3Terminate(fmi3Instance c) { return (fmi3Status)ball_enter(c, OVER, CONTINUOUS); }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    Ball *b = c;
    (void)m;
    ball_compute(b);
    for (size_t i = 0; i < n; i++) v[i] = b->real[r[i]];
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
    int status = OK;
    (void)m;
    for (size_t i = 0; i < n && status == OK; i++) status = ball_set_real(c, r[i], v[i]);
    return (fmi3Status)status;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int32 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = ((Ball *)c)->integer[r[i] - 100];
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) ((Ball *)c)->integer[r[i] - 100] = v[i];
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Boolean v[], size_t m) {
    (void)r, (void)m;
    return n ? (fmi3Status)ball_set_kick(c, v[0]) : fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *s) {
    if (!*s) *s = malloc(sizeof(Ball));
    if (!*s) return fmi3Error;
    memcpy(*s, c, sizeof(Ball));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState s) {
    memcpy(c, s, sizeof(Ball));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) {
    (void)c;
    free(*s);
    *s = NULL;
    return fmi3OK;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference u[], size_t n,
                                        const fmi3ValueReference k[], size_t m, const fmi3Float64 d[], size_t nd,
                                        fmi3Float64 e[], size_t ne) {
    if (m != 1 || nd != m || ne != n) return fmi3Error;
    for (size_t i = 0; i < n; i++)
        if (ball_derivative(c, u[i], k[0], d[0], &e[i]) != OK) return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) { return (fmi3Status)ball_enter(c, EVENT, CONTINUOUS); }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return (fmi3Status)ball_enter(c, CONTINUOUS, EVENT); }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *incomplete, fmi3Boolean *over, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next) {
    Ball *b = c;
    if (b->mode != EVENT) return (fmi3Status)refuse(b, "discrete states were updated outside of event mode");
    *incomplete = ball_update(b);
    *over = b->is_done;
    *nominals = fmi3False;
    *values = fmi3True;
    *has_next = ball_has_next(b);
    *next = ball_next(b);
    return fmi3OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *over) {
    *event = ball_complete(c, no_set);
    *over = fmi3False;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { return (fmi3Status)ball_set_time(c, t); }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    return n == 2 ? (fmi3Status)ball_set_states(c, x) : fmi3Error;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    return n == 2 ? (fmi3Status)ball_rates(c, dx) : fmi3Error;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
    if (n) z[0] = ((Ball *)c)->real[H];
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    if (n == 2) x[0] = ((Ball *)c)->real[H], x[1] = ((Ball *)c)->real[V];
    return fmi3OK;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = 1;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { (void)c; *n = 2; return fmi3OK; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { (void)c; *n = 1; return fmi3OK; }
