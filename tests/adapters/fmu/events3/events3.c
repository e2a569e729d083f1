/* Events of all kinds behind the FMI 3.0 co-simulation interface; whoever does in one mode what belongs to
 * another gets an error. Without event mode it handles its events alone. Written for the tests. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { LEVEL = 1, U, PERIOD, THRESHOLD, X, ROUNDS, LAST_TICK, TICKS, FALLS, JUMPS, STUCK };
typedef enum { INIT, EVENT, STEP } Mode;
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    fmi3Boolean uses_events, may_return_early;
    Mode mode;
    fmi3Float64 t, level, u, period, threshold, x;
    fmi3Int32 rounds, last_tick, ticks, falls, jumps, stuck;
    fmi3Int32 round, was_stuck;
} Events;

static fmi3Status refuse(Events *e, const char *why) {
    e->log(e->environment, fmi3Error, "error", why);
    return fmi3Error;
}
static fmi3Float64 next(const Events *e) { return e->period > 0 ? (e->ticks + 1) * e->period : 1e300; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)intermediate, (void)n, (void)update;
    Events *e = strcmp(token, "{events3-test}") == 0 ? calloc(1, sizeof(Events)) : NULL;
    if (e) {
        e->environment = environment, e->log = log;
        e->uses_events = event_mode, e->may_return_early = early_return;
        e->level = 1, e->threshold = 1e9, e->rounds = 1, e->last_tick = 1000000;
    }
    return e;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)td, (void)tol, (void)sd, (void)stop;
    ((Events *)c)->t = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Events *e = c;
    e->mode = e->uses_events ? EVENT : STEP;
    e->jumps = -e->uses_events;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

static fmi3Float64 *real(Events *e, fmi3ValueReference r) {
    switch (r) {
    case 0: return &e->t;
    case LEVEL: return &e->level;
    case U: return &e->u;
    case PERIOD: return &e->period;
    case THRESHOLD: return &e->threshold;
    default: return &e->x;
    }
}
static fmi3Int32 *whole(Events *e, fmi3ValueReference r) {
    switch (r) {
    case ROUNDS: return &e->rounds;
    case LAST_TICK: return &e->last_tick;
    case TICKS: return &e->ticks;
    case FALLS: return &e->falls;
    case STUCK: return &e->stuck;
    default: return &e->jumps;
    }
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = *real(c, r[i]);
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
    Events *e = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == LEVEL && e->uses_events && e->mode == STEP) return refuse(e, "level jumps in step mode");
        *real(e, r[i]) = v[i];
    }
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int32 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = *whole(c, r[i]);
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[], size_t m) {
    (void)m;
    for (size_t i = 0; i < n; i++) *whole(c, r[i]) = v[i];
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Events *e = c;
    if (!e->uses_events || e->mode != STEP) return refuse(e, "no step mode to enter event mode from");
    e->mode = EVENT;
    e->round = 0;
    return fmi3OK;
}
fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    Events *e = c;
    if (e->mode != EVENT || e->round < e->rounds) return refuse(e, "the discrete states have not settled");
    e->mode = STEP;
    e->round = 0;
    return fmi3OK;
}
/* Whatever happens at the current time; the number of events. */
static int happen(Events *e) {
    int count = 0;
    if (e->t >= next(e)) e->ticks++, count++;
    if (e->x >= e->threshold) e->x = 0, e->falls++, count++;
    return count;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *defined,
                                    fmi3Float64 *time) {
    Events *e = c;
    if (e->mode != EVENT) return refuse(e, "discrete states are updated in event mode");
    *nominals = *values = fmi3False;
    if (e->round++ == 0 && happen(e) == 0) e->jumps++;
    *again = e->rounds < 0 || e->round < e->rounds;
    *terminate = e->ticks >= e->last_tick;
    *defined = e->period > 0;
    *time = *defined ? next(e) : -1;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    Events *e = c;
    (void)no_set_state;
    *event = *terminate = *early_return = fmi3False;
    if (e->mode != STEP) return refuse(e, "a step in event mode");
    if (t > e->t + 1e-9 || t < e->t - 1e-9) return refuse(e, "a step from another time");
    if (e->uses_events && e->may_return_early && t + h > next(e) + 1e-9)
        return refuse(e, "a step beyond an event that was announced");
    *last = e->t;
    if (e->was_stuck < e->stuck) {
        e->was_stuck++;
        *event = *early_return = fmi3True;
        return fmi3OK;
    }
    e->was_stuck = 0;
    const fmi3Float64 stop = t + h;
    while (e->t < stop) {
        const fmi3Float64 rate = e->level + e->u;
        fmi3Float64 until = stop;
        if (!e->uses_events && next(e) < until) until = next(e);
        const fmi3Float64 crossing = rate > 0 ? e->t + (e->threshold - e->x) / rate : 1e300;
        const int crosses = crossing <= until;
        if (crosses) until = crossing;
        e->x = crosses ? e->threshold : e->x + rate * (until - e->t);
        e->t = until;
        if (e->uses_events && crosses) {
            *event = fmi3True;
            *early_return = until < stop;
            if (*early_return && !e->may_return_early) return refuse(e, "an early return is not allowed");
            break;
        }
        if (!e->uses_events) happen(e);
    }
    *last = e->t;
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Events));
    memcpy(*state, c, sizeof(Events));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Events));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    (void)c, (void)state;
    *size = sizeof(Events);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    (void)c;
    memcpy(bytes, state, size);
    return fmi3OK;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    Events *e = *state = malloc(size);
    memcpy(e, bytes, size);
    e->environment = ((Events *)c)->environment; /* addresses are those of this process */
    e->log = ((Events *)c)->log;
    return fmi3OK;
}
