/* What an importer says before the first step, FMI 3.0: start values, tolerance, stop time; written for
 * the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { U = 1, X, GUESS, Y, TOLERANCE, STOP, TWICE, RATE, COUNT };

typedef struct {
    fmi3Float64 value[COUNT];
    bool is_initialising;
} Starts;

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)environment, (void)log, (void)update;
    Starts *s = strcmp(token, "{starts3-test}") == 0 ? calloc(1, sizeof(Starts)) : NULL;
    if (s) s->value[U] = 2, s->value[X] = 1, s->value[GUESS] = 5;
    return s;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    Starts *s = c;
    (void)start;
    s->value[TOLERANCE] = td ? tol : -1;
    s->value[STOP] = sd ? stop : -1;
    s->is_initialising = true;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    Starts *s = c;
    (void)m;
    s->value[Y] = s->value[X] + 10 * s->value[U] + 100 * s->value[GUESS];
    s->value[TWICE] = 2 * s->value[X];
    for (size_t i = 0; i < n; i++) v[i] = s->value[r[i]];
    return fmi3OK;
}
/* A guess is taken before initialisation only (FMI 3.0.2, section 2.4.7.5). */
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[],
                          size_t m) {
    Starts *s = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (r[i] > GUESS || (s->is_initialising && r[i] != U)) return fmi3Error;
        s->value[r[i]] = v[i];
    }
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[], size_t m) {
    (void)c, (void)r, (void)n, (void)v, (void)m;
    return fmi3Error;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)no_set_state;
    ((Starts *)c)->value[X] += h;
    *event = *terminate = *early_return = fmi3False;
    *last = t + h;
    return fmi3OK;
}
