/* The time of the last step behind the FMI 3.0 co-simulation interface, and what a step may say beyond
 * its status; written for the tests. */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { TERMINATE = 1, EARLY_RETURN, DISCARD, DISCARD_SILENTLY, TERMINATE_WITH_WARNING, TERMINATE_WITHIN, PAUSE,
       PAUSE_BY_DISCARD, ONLY_SHORT };
#define SHORT 0.0003 /* [s] */

typedef struct {
    fmi3Float64 ends_at, y;
    fmi3Int32 kind, calls;
    fmi3Boolean may_return_early, is_kept;
    fmi3IntermediateUpdateCallback update;
} Ends;

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode;
    (void)environment, (void)log;
    if (update && !(n == 1 && intermediate[0] == 2)) return NULL;
    Ends *ends = strcmp(token, "{ends3-test}") == 0 ? calloc(1, sizeof(Ends)) : NULL;
    if (ends) ends->may_return_early = early_return, ends->update = update;
    return ends;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)td, (void)tol, (void)sd, (void)stop;
    ((Ends *)c)->y = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 1 ? ((Ends *)c)->ends_at : ((Ends *)c)->y;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[],
                          size_t m) {
    (void)r, (void)m;
    for (size_t i = 0; i < n; i++) ((Ends *)c)->ends_at = v[i];
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[], size_t m) {
    (void)r, (void)m;
    for (size_t i = 0; i < n; i++) ((Ends *)c)->kind = v[i];
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int32 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 4 ? ((Ends *)c)->calls : ((Ends *)c)->kind;
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *s) {
    if (!*s) *s = malloc(sizeof(Ends));
    if (!*s) return fmi3Error;
    ((Ends *)c)->is_kept = fmi3True;
    memcpy(*s, c, sizeof(Ends));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState s) {
    memcpy(c, s, sizeof(Ends));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) {
    (void)c;
    free(*s);
    *s = NULL;
    return fmi3OK;
}

/* Come as far as `ends_at`. */
static fmi3Status pause(Ends *ends, fmi3Float64 *last, fmi3Status status) {
    ends->y = *last = ends->ends_at;
    ends->calls++;
    return status;
}

/* Show `y` within a step; whether the importer lets it be gone on with. */
static bool show(Ends *ends, fmi3Float64 t) {
    fmi3Boolean is_early = fmi3True;
    fmi3Float64 early = -1, y = ends->y;
    ends->y = t;
    ends->update(NULL, t, fmi3False, fmi3True, fmi3True, fmi3True, &is_early, &early);
    ends->update(NULL, t, fmi3False, fmi3False, fmi3False, fmi3False, &is_early, &early);
    ends->y = y;
    return !is_early && early == t;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    Ends *ends = c;
    if (ends->is_kept && no_set_state) return fmi3Error; /* why was it kept? */
    if (ends->update && !show(ends, t + h / 2)) return fmi3Error;
    *event = *terminate = *early_return = fmi3False;
    if (t + h > ends->ends_at) {
        switch (ends->kind) {
        case TERMINATE_WITH_WARNING:
        case TERMINATE: *terminate = fmi3True; break;
        case EARLY_RETURN: *early_return = fmi3True; *last = ends->ends_at; break;
        case DISCARD: *last = ends->ends_at; return fmi3Discard;
        case DISCARD_SILENTLY: return fmi3Discard;
        case TERMINATE_WITHIN: *terminate = fmi3True; return pause(ends, last, fmi3Discard);
        case PAUSE:
            if (t >= ends->ends_at || !ends->may_return_early) break;
            *early_return = fmi3True;
            return pause(ends, last, fmi3OK);
        case PAUSE_BY_DISCARD:
            if (t >= ends->ends_at) break;
            return pause(ends, last, fmi3Discard);
        case ONLY_SHORT:
            if (h > SHORT) return fmi3Discard;
            break;
        default: *event = fmi3True; /* nobody has to enter event mode */
        }
    }
    ends->y = t + h;
    ends->calls++;
    return *terminate && ends->kind == TERMINATE_WITH_WARNING ? fmi3Warning : fmi3OK;
}
