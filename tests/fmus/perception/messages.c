/* The codec of the perception unit as functions on arrays, for tests against the one in Python.
 * Compiled together with the sources of the FMU itself. */
#include "apm.h"
#include "compression.h"
#include "seen_compression.h"

#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* The compressed form of cells that are points (levels = 0) or shares; its size, or 0. */
EXPORT size_t compressed(uint8_t *out, size_t capacity, const uint8_t *cells, const uint8_t *layer,
                         uint32_t rows, uint32_t columns, uint32_t levels) {
    if (levels) return compress_seen(out, capacity, cells, layer, (SeenShape){rows, columns, levels});
    return compress(out, capacity, cells, layer, (size_t)rows * columns);
}

/* Copy the cells and the layer of a message, if it has one, to `out`, which has room for `capacity`
 * bytes; `used` becomes their number and `taken` the memory that the codec took. If the message is
 * refused, `why` is the reason. */
EXPORT int decoded(const uint8_t *message, size_t size, uint8_t *out, size_t capacity,
                   size_t *used, size_t *taken, char why[256]) {
    Apm apm;
    Bytes space = {0};
    Problem problem;
    Decoding what = apm_decode(&apm, &space, message, size, &problem);
    *used = 0;
    *taken = space.capacity;
    if (what != DECODED) memcpy(why, problem.text, sizeof problem.text);
    else {
        size_t count = (size_t)apm.header.rows * apm.header.columns;
        *used = count * (apm.layer ? 8 : 4);
        if (*used <= capacity) {
            memcpy(out, apm.cells, 4 * count);
            if (apm.layer) memcpy(out + 4 * count, apm.layer, 4 * count);
        }
    }
    free(space.data);
    return what;
}
