/* Texts and Binaries behind the FMI 3.0 co-simulation interface that are given back as they came; after a
 * step at 9 s the text is none in UTF-8. Written for the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { WORD = 1, PAIR, BITS, TITLE, LIST, OUTPUTS = 10 };
typedef struct {
    char text[6][2][64];
    unsigned char bits[2][64];
    size_t sizes[2];
} Words;

static size_t length(fmi3ValueReference r) {
    r %= OUTPUTS;
    return r == WORD || r == TITLE ? 1 : 2;
}
static void put(Words *w, int variable, int element, const char *text) {
    strncpy(w->text[variable][element], text, 63);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)environment, (void)log, (void)update;
    Words *w = strcmp(token, "{words3-test}") == 0 ? calloc(1, sizeof(Words)) : NULL;
    if (w) put(w, TITLE, 0, "four"), put(w, LIST, 0, "five"), put(w, LIST, 1, "six");
    return w;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3String v[], size_t m) {
    size_t k = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t e = 0; e < length(r[i]); e++) {
            if (k == m) return fmi3Error;
            put(c, (int)r[i], (int)e, v[k++]);
        }
    return k == m ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3String v[], size_t m) {
    size_t k = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t e = 0; e < length(r[i]); e++) {
            if (k == m) return fmi3Error;
            v[k++] = ((Words *)c)->text[r[i] % OUTPUTS][e];
        }
    return k == m ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, const size_t sizes[],
                         const fmi3Binary v[], size_t m) {
    Words *w = c;
    if (n != 1 || r[0] != BITS || m != 2) return fmi3Error;
    for (size_t e = 0; e < 2; e++) memcpy(w->bits[e], v[e], w->sizes[e] = sizes[e]);
    return fmi3OK;
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[], fmi3Binary v[],
                         size_t m) {
    Words *w = c;
    if (n != 1 || r[0] != BITS + OUTPUTS || m != 2) return fmi3Error;
    for (size_t e = 0; e < 2; e++) v[e] = w->bits[e], sizes[e] = w->sizes[e];
    return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)no_set_state;
    *event = *terminate = *early_return = fmi3False;
    *last = t + h;
    if (t >= 9) put(c, WORD, 0, "ab\xff\xfe");
    return fmi3OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Words));
    memcpy(*state, c, sizeof(Words));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(c, state, sizeof(Words));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}
