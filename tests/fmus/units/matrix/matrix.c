#include <stdlib.h>
#include <string.h>

#include "fmi3_model.h"
#include "variables.h"

typedef struct {
    double offset;
    int32_t begins;
} State;

static ModelStatus create(Instance *m, void **state) {
    *state = calloc(1, sizeof(State));
    return *state ? MODEL_OK : model_log(m, MODEL_ERROR, "out of memory");
}

static void destroy(Instance *m, void *state) {
    (void)m;
    free(state);
}

static ModelStatus begin(Instance *m, void *state, double t) {
    (void)t;
    State *s = state;
    s->offset = *(double *)variable_data(m, VR_offset);
    s->begins++;
    return MODEL_OK;
}

static ModelStatus output(Instance *m, void *state, double t) {
    (void)t;
    const State *s = state;
    size_t n = variable_length(m, VR_row_value) / 4;
    double gain = *(double *)variable_data(m, VR_gain);
    const double *row = variable_data(m, VR_row_value);
    double *scaled = variable_data(m, VR_row_scaled), *product = variable_data(m, VR_product);
    for (size_t i = 0; i < 4 * n; i++) scaled[i] = gain * row[i] + s->offset;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double sum = 0;
            for (size_t k = 0; k < 4; k++) sum += row[4 * i + k] * row[4 * j + k];
            product[i * n + j] = sum;
        }
    int32_t *spare = variable_data(m, VR_spare);
    for (size_t i = 0; i < variable_length(m, VR_spare); i++) spare[i] = (int32_t)i;
    *(int32_t *)variable_data(m, VR_begins) = s->begins;
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    return output(m, state, t + h);
}

static size_t save(Instance *m, void *state, uint8_t *bytes) {
    (void)m;
    if (bytes) memcpy(bytes, state, sizeof(State));
    return sizeof(State);
}

static ModelStatus load(Instance *m, void *state, const uint8_t *bytes, size_t size) {
    if (size != sizeof(State)) return model_log(m, MODEL_ERROR, "%zu bytes are no state", size);
    memcpy(state, bytes, size);
    return MODEL_OK;
}

const ModelOps MODEL = {
    .create = create, .destroy = destroy, .begin = begin, .output = output,
    .step = step,     .save = save,       .load = load,
};
