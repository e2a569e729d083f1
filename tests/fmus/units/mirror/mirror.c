#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "fmi3_model.h"
#include "variables.h"

#define CHANGE(TYPE, NAME, VALUE)                               \
    do {                                                        \
        const TYPE *in = variable_data(m, VR_##NAME##_in);      \
        TYPE *out = variable_data(m, VR_##NAME##_out);          \
        size_t n = variable_length(m, VR_##NAME##_in);          \
        for (size_t k = 0; k < n; k++) out[k] = (TYPE)(VALUE);  \
    } while (0)

enum { LONGEST = 40 };

static ModelStatus output(Instance *m, void *state, double t) {
    (void)state;
    int64_t count = (int64_t)floor(1000 * t + 0.5);
    CHANGE(float, float32, in[k] / 2 + (float)t);
    CHANGE(double, float64, in[k] / 2 + t);
    CHANGE(int8_t, int8, (uint8_t)in[k] + (uint8_t)count);
    CHANGE(uint8_t, uint8, in[k] + (uint8_t)count);
    CHANGE(int16_t, int16, (uint16_t)in[k] + (uint16_t)count);
    CHANGE(uint16_t, uint16, in[k] + (uint16_t)count);
    CHANGE(int32_t, int32, (uint32_t)in[k] + (uint32_t)count);
    CHANGE(uint32_t, uint32, in[k] + (uint32_t)count);
    CHANGE(int64_t, int64, (uint64_t)in[k] + (uint64_t)count);
    CHANGE(uint64_t, uint64, in[k] + (uint64_t)count);
    CHANGE(int64_t, enumeration, in[k] % 3 + 1);
    CHANGE(bool, boolean, in[k] != (count % 5 == (int64_t)k));
    const Binary *in = variable_binary(m, VR_payload);
    Binary *out = variable_binary(m, VR_copy);
    size_t kept = in->size < LONGEST ? in->size : LONGEST - (size_t)(count % 30);
    if (binary_reserve(out, kept + 1)) return model_log(m, MODEL_ERROR, "out of memory");
    if (kept != 0) memcpy(out->data, in->data, kept);
    out->data[kept] = (uint8_t)count;
    out->size = kept + 1;
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    return output(m, state, t + h);
}

const ModelOps MODEL = {.output = output, .step = step};
