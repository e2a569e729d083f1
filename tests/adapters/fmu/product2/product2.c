/* A product with known derivatives behind the FMI 2.0 co-simulation interface, a text that travels and a
 * state that can be stored as bytes; written for the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { A, B, Y, SAID, PREFIX, HEARD };
typedef struct {
    fmi2Real a, b;
    char said[64], prefix[64], heard[128];
} Product;

static void copy(char *to, size_t size, const char *from) {
    strncpy(to, from, size - 1);
    to[size - 1] = 0;
}

/* Bytes that no importer would set: `hex:ff` is heard as the byte 255. */
static void decode(char *to, const char *from) {
    for (; *from; from += 2) {
        const char digits[3] = {from[0], from[1], 0};
        *to++ = (char)strtol(digits, NULL, 16);
    }
    *to = 0;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)resources, (void)callbacks, (void)visible, (void)logging;
    Product *p = strcmp(guid, "{product2-test}") == 0 ? calloc(1, sizeof(Product)) : NULL;
    if (p) p->a = 2, p->b = 3, copy(p->said, sizeof p->said, "nothing"), copy(p->prefix, 64, "heard: ");
    return p;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start, fmi2Boolean sd,
                               fmi2Real stop) {
    (void)c, (void)td, (void)tol, (void)start, (void)sd, (void)stop;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return fmi2Error; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    const Product *p = c;
    for (size_t i = 0; i < n; i++) v[i] = r[i] == A ? p->a : r[i] == B ? p->b : p->a * p->b;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    Product *p = c;
    for (size_t i = 0; i < n; i++) *(r[i] == A ? &p->a : &p->b) = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) {
    Product *p = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == HEARD) {
            copy(p->heard, sizeof p->heard, p->prefix);
            strcat(p->heard, p->said);
            if (strncmp(p->said, "hex:", 4) == 0) decode(p->heard, p->said + 4);
        }
        v[i] = r[i] == SAID ? p->said : r[i] == PREFIX ? p->prefix : p->heard;
    }
    return fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) {
    Product *p = c;
    for (size_t i = 0; i < n; i++) copy(r[i] == SAID ? p->said : p->prefix, 64, v[i]);
    return fmi2OK;
}
#define REFUSED(name, type)                                                                       \
    fmi2Status fmi2##name(fmi2Component c, const fmi2ValueReference r[], size_t n, type v[]) {     \
        (void)c, (void)r, (void)n, (void)v;                                                        \
        return fmi2Error;                                                                          \
    }
REFUSED(GetInteger, fmi2Integer)
REFUSED(SetInteger, const fmi2Integer)
REFUSED(GetBoolean, fmi2Boolean)
REFUSED(SetBoolean, const fmi2Boolean)

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nu,
                                        const fmi2ValueReference known[], size_t nk, const fmi2Real seed[],
                                        fmi2Real out[]) {
    const Product *p = c;
    for (size_t i = 0; i < nu; i++) {
        if (unknown[i] != Y) return fmi2Error;
        out[i] = 0;
        for (size_t k = 0; k < nk; k++) out[i] += (known[k] == A ? p->b : p->a) * seed[k];
    }
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    (void)c, (void)t, (void)h, (void)no_set_state;
    return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
#define STATUS(name, type)                                                                         \
    fmi2Status fmi2Get##name##Status(fmi2Component c, const fmi2StatusKind s, type *v) {           \
        (void)c, (void)s, (void)v;                                                                 \
        return fmi2Discard;                                                                        \
    }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *v) {
    (void)c, (void)s, (void)v;
    return fmi2Discard;
}
STATUS(Real, fmi2Real)
STATUS(Integer, fmi2Integer)
STATUS(Boolean, fmi2Boolean)
STATUS(String, fmi2String)
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                       const fmi2Integer o[], const fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                        const fmi2Integer o[], fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Product));
    memcpy(*state, c, sizeof(Product));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(c, state, sizeof(Product));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c, (void)state;
    *size = sizeof(Product);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    (void)c;
    memcpy(bytes, state, size);
    return size == sizeof(Product) ? fmi2OK : fmi2Error;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    (void)c;
    if (size != sizeof(Product)) return fmi2Error;
    *state = malloc(size);
    memcpy(*state, bytes, size);
    return fmi2OK;
}
