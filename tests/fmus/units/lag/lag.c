#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_model.h"
#include "variables.h"

typedef struct {
    size_t count;
    double *x;
} State;

static ModelStatus create(Instance *m, void **state) {
    *state = calloc(1, sizeof(State));
    return *state ? MODEL_OK : model_log(m, MODEL_ERROR, "out of memory");
}

static void destroy(Instance *m, void *state) {
    (void)m;
    if (state) free(((State *)state)->x);
    free(state);
}

static ModelStatus begin(Instance *m, void *state, double t) {
    (void)t;
    State *s = state;
    s->count = variable_length(m, VR_u);
    s->x = malloc(s->count * sizeof *s->x);
    if (!s->x) return model_log(m, MODEL_ERROR, "out of memory");
    for (size_t i = 0; i < s->count; i++) s->x[i] = *(double *)variable_data(m, VR_initial);
    return MODEL_OK;
}

static ModelStatus output(Instance *m, void *state, double t) {
    (void)t;
    const State *s = state;
    memcpy(variable_data(m, VR_x), s->x, s->count * sizeof *s->x);
    *(int64_t *)variable_data(m, VR_seed_used) = *(int64_t *)variable_data(m, VR_seed);
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    State *s = state;
    double decay = exp(-h / *(double *)variable_data(m, VR_time_constant));
    const double *u = variable_data(m, VR_u);
    for (size_t i = 0; i < s->count; i++) s->x[i] = u[i] + (s->x[i] - u[i]) * decay;
    return output(m, state, t + h);
}

static size_t save(Instance *m, void *state, uint8_t *bytes) {
    (void)m;
    const State *s = state;
    size_t size = s->count * sizeof *s->x;
    if (bytes && size != 0) memcpy(bytes, s->x, size);
    return size;
}

static ModelStatus load(Instance *m, void *state, const uint8_t *bytes, size_t size) {
    State *s = state;
    if (size != s->count * sizeof *s->x)
        return model_log(m, MODEL_ERROR, "%zu bytes are no state of %zu lags", size, s->count);
    if (size != 0) memcpy(s->x, bytes, size);
    return MODEL_OK;
}

const ModelOps MODEL = {
    .create = create, .destroy = destroy, .begin = begin, .output = output,
    .step = step,     .save = save,       .load = load,
};
