/* Products with known derivatives behind the FMI 3.0 co-simulation interface, and a state that can be
 * stored as bytes; written for the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { U = 1, P, Q, Y, Z, SUM, STAGE };
typedef struct {
    fmi3Float64 u[2], p, q, sum;
} Bilinear;

static size_t length(fmi3ValueReference r) { return r == U ? 2 : r == Y ? 3 : 1; }

/* the rows of the Jacobian: of y[0..2] and z by u[0], u[1] and p; asked for anything else: -1 */
static int row(fmi3ValueReference r) { return r == Y ? 0 : r == Z ? 3 : -1; }
static int column(fmi3ValueReference r) { return r == U ? 0 : r == P ? 2 : -1; }
static void jacobian(const Bilinear *b, fmi3Float64 j[4][3]) {
    const fmi3Float64 values[4][3] = {
        {b->p, 0, b->u[0]}, {0, b->p, b->u[1]}, {b->u[1], b->u[0], 0}, {0, 0, 3}};
    memcpy(j, values, sizeof values);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)environment, (void)log, (void)update;
    Bilinear *b = strcmp(token, "{bilinear3-test}") == 0 ? calloc(1, sizeof(Bilinear)) : NULL;
    if (b) b->u[0] = 2, b->u[1] = 3, b->p = 5, b->q = 7;
    return b;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    const Bilinear *b = c;
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        const fmi3Float64 y[3] = {b->u[0] * b->p, b->u[1] * b->p, b->u[0] * b->u[1]};
        const fmi3Float64 scalar = r[i] == Z ? 3 * b->p : r[i] == SUM ? b->sum : b->q;
        memcpy(v + k, r[i] == Y ? y : &scalar, length(r[i]) * sizeof *v);
        k += length(r[i]);
    }
    return k == m ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[],
                          size_t m) {
    Bilinear *b = c;
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        memcpy(r[i] == U ? b->u : r[i] == P ? &b->p : &b->q, v + k, length(r[i]) * sizeof *v);
        k += length(r[i]);
    }
    return k == m ? fmi3OK : fmi3Error;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)no_set_state;
    *event = *terminate = *early_return = fmi3False;
    *last = t + h;
    ((Bilinear *)c)->sum += ((Bilinear *)c)->p;
    return fmi3OK;
}

static fmi3Status multiply(const Bilinear *b, const fmi3ValueReference unknown[], size_t n_unknown,
                           const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                           size_t n_seed, fmi3Float64 out[], size_t n_out, int is_adjoint) {
    fmi3Float64 j[4][3];
    jacobian(b, j);
    memset(out, 0, n_out * sizeof *out);
    size_t rows = 0, columns = 0;
    for (size_t i = 0; i < n_unknown; i++) {
        if (row(unknown[i]) < 0) return fmi3Error;
        columns = 0;
        for (size_t k = 0; k < n_known; k++) {
            if (column(known[k]) < 0) return fmi3Error;
            for (size_t a = 0; a < length(unknown[i]); a++) {
                for (size_t e = 0; e < length(known[k]); e++) {
                    const fmi3Float64 d = j[row(unknown[i]) + (int)a][column(known[k]) + (int)e];
                    if (is_adjoint) out[columns + e] += d * seed[rows + a];
                    else out[rows + a] += d * seed[columns + e];
                }
            }
            columns += length(known[k]);
        }
        rows += length(unknown[i]);
    }
    return (is_adjoint ? n_seed == rows && n_out == columns : n_seed == columns && n_out == rows) ? fmi3OK
                                                                                                : fmi3Error;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference u[], size_t nu,
                                        const fmi3ValueReference k[], size_t nk, const fmi3Float64 seed[],
                                        size_t ns, fmi3Float64 out[], size_t no) {
    return multiply(c, u, nu, k, nk, seed, ns, out, no, 0);
}
fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference u[], size_t nu,
                                    const fmi3ValueReference k[], size_t nk, const fmi3Float64 seed[],
                                    size_t ns, fmi3Float64 out[], size_t no) {
    return multiply(c, u, nu, k, nk, seed, ns, out, no, 1);
}

/* States are copies with a mark of what made them, so that bytes of another program are refused. */
static const char MARK[9] = "bilinear";
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Bilinear));
    memcpy(*state, c, sizeof(Bilinear));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Bilinear));
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
    *size = sizeof MARK + sizeof(Bilinear);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    (void)c;
    if (size != sizeof MARK + sizeof(Bilinear)) return fmi3Error;
    memcpy(bytes, MARK, sizeof MARK);
    memcpy(bytes + sizeof MARK, state, sizeof(Bilinear));
    return fmi3OK;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    (void)c;
    if (size != sizeof MARK + sizeof(Bilinear) || memcmp(bytes, MARK, sizeof MARK)) return fmi3Error;
    *state = malloc(sizeof(Bilinear));
    memcpy(*state, bytes + sizeof MARK, sizeof(Bilinear));
    return fmi3OK;
}
