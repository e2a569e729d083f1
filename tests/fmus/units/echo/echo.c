#include <stdbool.h>
#include <string.h>

#include "fmi3_model.h"
#include "variables.h"

static void copy(Instance *m, uint32_t from, uint32_t to, size_t size) {
    size_t bytes = variable_length(m, from) * size;
    if (bytes != 0) memcpy(variable_data(m, to), variable_data(m, from), bytes);
}

static ModelStatus output(Instance *m, void *state, double t) {
    (void)state, (void)t;
    copy(m, VR_float32_in, VR_float32_out, 4);
    copy(m, VR_float64_in, VR_float64_out, 8);
    copy(m, VR_int8_in, VR_int8_out, 1);
    copy(m, VR_uint8_in, VR_uint8_out, 1);
    copy(m, VR_int16_in, VR_int16_out, 2);
    copy(m, VR_uint16_in, VR_uint16_out, 2);
    copy(m, VR_int32_in, VR_int32_out, 4);
    copy(m, VR_uint32_in, VR_uint32_out, 4);
    copy(m, VR_int64_in, VR_int64_out, 8);
    copy(m, VR_uint64_in, VR_uint64_out, 8);
    copy(m, VR_enumeration_in, VR_enumeration_out, 8);
    copy(m, VR_boolean_in, VR_boolean_out, sizeof(bool));
    const Binary *in = variable_binary(m, VR_payload);
    Binary *out = variable_binary(m, VR_copy);
    if (binary_reserve(out, in->size)) return model_log(m, MODEL_ERROR, "out of memory");
    if (in->size != 0) memcpy(out->data, in->data, in->size);
    out->size = in->size;
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    return output(m, state, t + h);
}

const ModelOps MODEL = {.output = output, .step = step};
