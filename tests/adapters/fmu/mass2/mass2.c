/* A mass on its own spring, and a spring to what moves at `xin`, behind the FMI 2.0 co-simulation
 * interface; written for the tests. Inputs run over a step as their derivatives say.
 *
 *   m x'' = -k x - d x' + f - force,  force = kc (x - xin) + cc (x' - vin)
 */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { MASS, STIFFNESS, DAMPING, SPRING, DAMPER, F, XIN, VIN, X, V, FORCE, TOLD, LONGEST, COUNT };
enum { INPUTS = 3, ORDERS = 2, PIECES = 40 };

typedef struct {
    fmi2Real values[COUNT];
    fmi2Real rates[INPUTS][ORDERS]; /* of the inputs, where the step begins */
    fmi2Real slopes[INPUTS];        /* of the inputs, where it ends */
    fmi2Real rate;                  /* of the velocity, where it ends */
    fmi2Real time;                  /* that was reached */
    fmi2Boolean is_running, is_set; /* set since the last step: nothing may be asked */
    const fmi2CallbackFunctions *callbacks;
} Mass;

static fmi2Real input(const Mass *m, int k, fmi2Real s) {
    return m->values[F + k] + s * (m->rates[k][0] + s * m->rates[k][1] / 2);
}
static fmi2Real force(const Mass *m, const fmi2Real state[2], fmi2Real s) {
    const fmi2Real *p = m->values;
    return p[SPRING] * (state[0] - input(m, 1, s)) + p[DAMPER] * (state[1] - input(m, 2, s));
}
static fmi2Real acceleration(const Mass *m, const fmi2Real state[2], fmi2Real s) {
    const fmi2Real *p = m->values;
    return (input(m, 0, s) - p[STIFFNESS] * state[0] - p[DAMPING] * state[1] - force(m, state, s)) /
           p[MASS];
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)name, (void)resources, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || strcmp(guid, "{mass2-test}") != 0) return NULL;
    Mass *m = callbacks->allocateMemory(1, sizeof *m);
    if (!m) return NULL;
    *m = (Mass){.values = {[MASS] = 1, [STIFFNESS] = 1, [LONGEST] = 1e9}, .callbacks = callbacks};
    return m;
}
void fmi2FreeInstance(fmi2Component c) {
    Mass *m = c;
    if (m) m->callbacks->freeMemory(m);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start,
                               fmi2Boolean sd, fmi2Real stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
static void finish(Mass *m, fmi2Real h) {
    m->values[FORCE] = force(m, &m->values[X], h);
    m->rate = acceleration(m, &m->values[X], h);
    for (int k = 0; k < INPUTS; k++) m->slopes[k] = m->rates[k][0] + h * m->rates[k][1];
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Mass *m = c;
    finish(m, 0);
    m->is_running = fmi2True;
    m->is_set = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    Mass *m = c;
    for (size_t i = 0; i < n; i++) m->values[r[i]] = v[i];
    m->is_set = m->is_running;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    Mass *m = c;
    if (m->is_set) return fmi2Error; /* FMI 2.0.4, section 4.2.4 */
    if (!m->is_running) finish(m, 0);
    for (size_t i = 0; i < n; i++) v[i] = m->values[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer o[], const fmi2Real v[]) {
    Mass *m = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] < F || r[i] > VIN || o[i] < 1 || o[i] > ORDERS) return fmi2Error;
        m->rates[r[i] - F][o[i] - 1] = v[i];
        if (o[i] > m->values[TOLD]) m->values[TOLD] = o[i];
    }
    return fmi2OK;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                        const fmi2Integer o[], fmi2Real v[]) {
    Mass *m = c;
    const fmi2Real *p = m->values;
    if (m->is_set || !m->is_running) return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (o[i] != 1) return fmi2Error;
        if (r[i] == X) v[i] = p[V];
        else if (r[i] == V) v[i] = m->rate;
        else if (r[i] == FORCE) 
            v[i] = p[SPRING] * (p[V] - m->slopes[1]) + p[DAMPER] * (m->rate - m->slopes[2]);
        else return fmi2Error;
    }
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Mass *m = c;
    (void)no_set_state;
    m->time = t;
    if (h > m->values[LONGEST] * 1.000001) return fmi2Discard;
    fmi2Real *x = &m->values[X], d = h / PIECES;
    for (int piece = 0; piece < PIECES; piece++) { /* Runge-Kutta, order 4 */
        static const fmi2Real at[] = {0, 0.5, 0.5, 1}, share[] = {1, 2, 2, 1};
        fmi2Real sum[2] = {0, 0}, slope[2] = {0, 0};
        for (int stage = 0; stage < 4; stage++) {
            fmi2Real y[2] = {x[0] + at[stage] * d * slope[0], x[1] + at[stage] * d * slope[1]};
            slope[0] = y[1];
            slope[1] = acceleration(m, y, (piece + at[stage]) * d);
            for (int k = 0; k < 2; k++) sum[k] += share[stage] * slope[k];
        }
        for (int k = 0; k < 2; k++) x[k] += d / 6 * sum[k];
    }
    finish(m, h);
    m->is_set = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *v) {
    (void)kind;
    *v = ((Mass *)c)->time;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    if (!*s) *s = malloc(sizeof(Mass));
    if (!*s) return fmi2Error;
    memcpy(*s, c, sizeof(Mass));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    memcpy(c, s, sizeof(Mass));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) {
    (void)c;
    free(*s);
    *s = NULL;
    return fmi2OK;
}
