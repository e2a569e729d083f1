/* Clocks of all kinds behind the FMI 3.0 co-simulation interface: their ticks are counted; ticks at wrong
 * times, and access to clocked variables while their clocks rest, are errors. Written for the tests.
 *
 * `every` ticks at 0.1 s, 0.4 s, 0.7 s, ...; `asked` each third of a second, or each quarter
 * if it is asked for a decimal, with a shift of 0.05 s; `changing` after 0.1 s, 0.2 s
 * more, 0.3 s more, ...; `countdown` `fuse` after that was set, and once more at the same time if it is
 * `TWICE`. `alarm` ticks with every third tick of `every`. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { EVERY = 1, ASKED, CHANGING, COUNTDOWN, PULL, ALARM, CLOCKS };
enum { FUSE = 10, SAMPLE, COUNTS = 20, SAMPLED = 26, AT, ORDER, N_ALARM };
static const fmi3Float64 TWICE = 0.05;
typedef enum { INIT, EVENT, STEP } Mode;
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    Mode mode;
    fmi3Float64 t, fuse, sample, sampled, at, countdown_from, interval, shift;
    fmi3Int32 count[CLOCKS];
    fmi3Boolean is_active[CLOCKS], is_fused, is_told, is_second;
    char order[32];
} Clocks;

static fmi3Status refuse(Clocks *k, const char *why) {
    k->log(k->environment, fmi3Error, "error", why);
    return fmi3Error;
}
/* When a clock ticks for the n-th time, counted from 0. */
static fmi3Float64 tick(const Clocks *k, int clock, int n) {
    switch (clock) {
    case EVERY: return 0.1 + 0.3 * n;
    case ASKED: return k->shift + n * k->interval;
    case CHANGING: return 0.1 * (n + 1) * (n + 2) / 2;
    case COUNTDOWN: return k->is_told ? k->countdown_from + (k->is_second ? 0 : k->fuse) : 1e300;
    default: return 1e300;
    }
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate, (void)n;
    (void)update;
    Clocks *k = event_mode && strcmp(token, "{clocks3-test}") == 0 ? calloc(1, sizeof(Clocks)) : NULL;
    if (k) k->environment = environment, k->log = log, k->sample = 1;
    return k;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)td, (void)tol, (void)sd, (void)stop;
    ((Clocks *)c)->t = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { ((Clocks *)c)->mode = EVENT; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

static fmi3Boolean may_access(Clocks *k, fmi3ValueReference r) {
    if (k->mode == INIT || r == FUSE || r == 0) return fmi3True;
    if (k->mode != EVENT) return fmi3False;
    if (r == SAMPLE || r == SAMPLED) return k->is_active[PULL];
    if (r == N_ALARM) return k->is_active[ALARM];
    if (r > COUNTS && r < SAMPLED) return k->is_active[r - COUNTS];
    for (int i = EVERY; i <= PULL; i++)
        if (k->is_active[i]) return fmi3True;
    return fmi3False;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    Clocks *k = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (!may_access(k, r[i])) return refuse(k, "a clocked variable is got while its clock rests");
        v[i] = r[i] == SAMPLED ? k->sampled : r[i] == AT ? k->at : r[i] == FUSE ? k->fuse : k->t;
    }
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
    Clocks *k = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (!may_access(k, r[i])) return refuse(k, "a clocked variable is set while its clock rests");
        if (r[i] == SAMPLE) k->sample = v[i];
        if (r[i] == FUSE) k->fuse = v[i], k->is_fused = v[i] > 0;
    }
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int32 v[], size_t m) {
    Clocks *k = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (!may_access(k, r[i])) return refuse(k, "a clocked variable is got while its clock rests");
        v[i] = k->count[r[i] == N_ALARM ? ALARM : r[i] - COUNTS];
    }
    return fmi3OK;
}
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3String v[], size_t m) {
    Clocks *k = c;
    (void)m;
    for (size_t i = 0; i < n; i++) {
        if (!may_access(k, r[i])) return refuse(k, "a clocked variable is got while its clock rests");
        v[i] = k->order;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Clock v[]) {
    Clocks *k = c;
    if (k->mode != EVENT) return refuse(k, "clocks tick in event mode");
    for (size_t i = 0; i < n; i++) {
        if (r[i] < EVERY || r[i] > PULL || !v[i]) return refuse(k, "this clock cannot be set");
        if (r[i] != PULL && fabs(k->t - tick(k, (int)r[i], r[i] == COUNTDOWN ? 0 : k->count[r[i]])) > 1e-9)
            return refuse(k, "a tick at the wrong time");
        k->is_active[r[i]] = fmi3True;
        k->count[r[i]]++;
        k->at = k->t;
        const char name[2] = {(char)('0' + r[i]), 0};
        strncat(k->order, name, sizeof k->order - strlen(k->order) - 1);
        if (r[i] == EVERY && k->count[EVERY] % 3 == 0) k->is_active[ALARM] = fmi3True, k->count[ALARM]++;
        if (r[i] == COUNTDOWN) {
            k->is_told = fmi3False;
            k->is_second = !k->is_second && k->fuse == TWICE;
            k->is_fused = k->is_second;
        }
    }
    return fmi3OK;
}
fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Clock v[]) {
    Clocks *k = c;
    if (k->mode != EVENT) return refuse(k, "clocks tick in event mode");
    for (size_t i = 0; i < n; i++) v[i] = k->is_active[r[i]];
    if (k->is_active[PULL]) k->sampled = k->sample;
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
                                  fmi3IntervalQualifier q[]) {
    Clocks *k = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == CHANGING) {
            v[i] = 0.1 * (k->count[CHANGING] + 1);
            q[i] = fmi3IntervalChanged;
        } else if (r[i] == COUNTDOWN) {
            v[i] = k->is_second ? 0 : k->fuse;
            q[i] = k->is_fused ? fmi3IntervalChanged : k->is_told ? fmi3IntervalUnchanged : fmi3IntervalNotYetKnown;
            if (k->is_fused) k->countdown_from = k->t, k->is_told = fmi3True;
            k->is_fused = fmi3False;
        } else if (r[i] == ASKED) {
            v[i] = k->interval = 0.25;
            q[i] = fmi3IntervalChanged;
        } else {
            return refuse(k, "nobody asks this clock for a decimal");
        }
    }
    return fmi3OK;
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ASKED) return refuse(c, "nobody asks this clock for a shift");
        v[i] = ((Clocks *)c)->shift = 0.05;
    }
    return fmi3OK;
}
fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3UInt64 counter[],
                                   fmi3UInt64 resolution[], fmi3IntervalQualifier q[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ASKED) return refuse(c, "nobody asks this clock for a fraction");
        counter[i] = 1, resolution[i] = 3, q[i] = fmi3IntervalChanged;
        ((Clocks *)c)->interval = 1 / 3.0;
    }
    return fmi3OK;
}
fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3UInt64 counter[],
                                fmi3UInt64 resolution[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ASKED) return refuse(c, "nobody asks this clock for a shift");
        counter[i] = 0, resolution[i] = 3;
    }
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Clocks *k = c;
    if (k->mode != STEP) return refuse(k, "no step mode to enter event mode from");
    k->mode = EVENT;
    return fmi3OK;
}
fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    Clocks *k = c;
    if (k->mode != EVENT) return refuse(k, "no event mode");
    k->mode = STEP;
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *defined,
                                    fmi3Float64 *time) {
    Clocks *k = c;
    *again = *terminate = *nominals = *values = *defined = fmi3False;
    *time = 0;
    memset(k->is_active, 0, sizeof k->is_active);
    k->order[0] = 0;
    return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    Clocks *k = c;
    (void)no_set_state;
    *event = *terminate = *early_return = fmi3False;
    if (k->mode != STEP) return refuse(k, "a step in event mode");
    for (int clock = EVERY; clock < PULL; clock++)
        if (t + h > tick(k, clock, clock == COUNTDOWN ? 0 : k->count[clock]) + 1e-9)
            return refuse(k, "a step beyond a tick");
    *last = k->t = t + h;
    return fmi3OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Clocks));
    memcpy(*state, c, sizeof(Clocks));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Clocks));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}
