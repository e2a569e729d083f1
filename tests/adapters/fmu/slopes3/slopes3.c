/* y = (t, t^2) and z = 3 t with their derivatives, FMI 3.0; written for the tests. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { Y = 1, Z };

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)environment, (void)log, (void)update;
    return strcmp(token, "{slopes3-test}") == 0 ? calloc(1, sizeof(fmi3Float64)) : NULL;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 tol, fmi3Float64 start,
                                       fmi3Boolean sd, fmi3Float64 stop) {
    (void)td, (void)tol, (void)sd, (void)stop;
    *(fmi3Float64 *)c = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
    fmi3Float64 t = *(fmi3Float64 *)c, *next = v;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == Y) *next++ = t, *next++ = t * t;
        else *next++ = 3 * t;
    }
    return (size_t)(next - v) == m ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference r[], size_t n,
                                    const fmi3Int32 o[], fmi3Float64 v[], size_t m) {
    fmi3Float64 *next = v;
    for (size_t i = 0; i < n; i++) {
        if (o[i] != 1) return fmi3Error;
        if (r[i] == Y) *next++ = 1, *next++ = 2 * *(fmi3Float64 *)c;
        else *next++ = 3;
    }
    return (size_t)(next - v) == m ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[],
                          size_t m) {
    (void)c, (void)r, (void)n, (void)v, (void)m;
    return fmi3Error;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 v[], size_t m) {
    (void)c, (void)r, (void)n, (void)v, (void)m;
    return fmi3Error;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)no_set_state;
    *(fmi3Float64 *)c = t + h;
    *event = *terminate = *early_return = fmi3False;
    *last = t + h;
    return fmi3OK;
}
