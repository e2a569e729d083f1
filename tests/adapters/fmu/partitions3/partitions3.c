/* Model partitions behind the FMI 3.0 scheduled execution interface, which write down when they ran; what
 * belongs to another mode, or comes out of order, is an error. Written for the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { FAST = 1, SLOW, LATER, PULL, OUT, DELAY = 10, SAMPLE, SAMPLED, N_FAST, N_OUT, LOG, PLAIN, PULLED };
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback message;
    fmi3ClockUpdateCallback update;
    fmi3Boolean is_initialised, is_updating, is_out, counts_down;
    fmi3Float64 delay, sample, sampled, plain, pulled, last[OUT], now;
    fmi3Int32 count[OUT];
    char log[256];
} Partitions;

static fmi3Status refuse(Partitions *p, const char *why) {
    p->message(p->environment, fmi3Error, "error", why);
    return fmi3Error;
}
fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)resources, (void)visible, (void)logging;
    lock();
    unlock();
    Partitions *p = strcmp(token, "{partitions3-test}") == 0 ? calloc(1, sizeof(Partitions)) : NULL;
    if (p) {
        p->environment = environment, p->message = log, p->update = update;
        p->delay = 0.03, p->sample = 1;
        for (int k = 0; k < OUT; k++) p->last[k] = -1;
    }
    return p;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    ((Partitions *)c)->is_initialised = fmi3True;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    const Partitions *p = c;
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = r[i] == SAMPLED ? p->sampled : p->pulled;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
    Partitions *p = c;
    (void)m;
    for (size_t i = 0; i < n; i++) *(r[i] == DELAY ? &p->delay : r[i] == PLAIN ? &p->plain : &p->sample) = v[i];
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int32 v[], size_t m) {
    const Partitions *p = c;
    (void)m;
    for (size_t i = 0; i < n; i++) v[i] = p->count[r[i] == N_FAST ? FAST : PULL];
    return fmi3OK;
}
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3String v[], size_t m) {
    (void)r, (void)m;
    for (size_t i = 0; i < n; i++) v[i] = ((Partitions *)c)->log;
    return fmi3OK;
}
fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Clock v[]) {
    Partitions *p = c;
    if (!p->is_updating) return refuse(p, "clocks are got in clock update mode");
    for (size_t i = 0; i < n; i++) v[i] = r[i] == OUT && p->is_out;
    p->is_out = fmi3False;
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[],
                                  fmi3IntervalQualifier q[]) {
    Partitions *p = c;
    if (p->is_initialised && !p->is_updating) return refuse(p, "intervals are got in clock update mode");
    for (size_t i = 0; i < n; i++) {
        if (r[i] != LATER) return refuse(p, "nobody asks this clock");
        v[i] = p->delay;
        q[i] = p->counts_down ? fmi3IntervalChanged : fmi3IntervalNotYetKnown;
    }
    if (p->delay < -1) return fmi3Error;
    p->counts_down = fmi3False;
    return fmi3OK;
}
fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t) {
    Partitions *p = c;
    if (clock < FAST || clock > PULL) return refuse(p, "no such partition");
    if (!(t > p->last[clock])) return refuse(p, "a partition runs twice at one time");
    if (t < p->now) return refuse(p, "time goes back");
    p->last[clock] = p->now = t;
    p->count[clock]++;
    strncat(p->log, &"-fslp"[clock], 1);
    if (clock == SLOW) p->sampled = p->sample;
    if (clock == PULL) p->is_out = fmi3True, p->pulled = p->plain;
    if (clock == SLOW && p->count[SLOW] % 2 == 0) p->counts_down = fmi3True;
    if (p->is_out || p->counts_down) {
        p->is_updating = fmi3True;
        p->update(p->environment);
        p->is_updating = fmi3False;
    }
    return fmi3OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Partitions));
    memcpy(*state, c, sizeof(Partitions));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Partitions));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}
