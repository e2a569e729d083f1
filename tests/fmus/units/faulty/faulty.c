#include <math.h>
#include <stdbool.h>

#include "fmi3_model.h"
#include "variables.h"

static ModelStatus begin(Instance *m, void *state, double t) {
    (void)state;
    if (*(bool *)variable_data(m, VR_refuse))
        return model_log(m, MODEL_ERROR, "told to refuse at t = %g", t);
    return model_log(m, MODEL_OK, "begins");
}

static ModelStatus output(Instance *m, void *state, double t) {
    (void)state;
    *(double *)variable_data(m, VR_y) = t;
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    int32_t kind = *(int32_t *)variable_data(m, VR_kind);
    bool warns = *(bool *)variable_data(m, VR_warns);
    if (t + h < 0.3 || kind == MODEL_OK) {
        output(m, state, t + h);
        return warns ? model_log(m, MODEL_WARNING, "it gets worse") : MODEL_OK;
    }
    if (warns) return (ModelStatus)kind;
    if (kind == 5) {
        *(double *)variable_data(m, VR_y) = NAN;
        return MODEL_OK;
    }
    if (kind == MODEL_WARNING) output(m, state, t + h);
    return model_log(m, (ModelStatus)kind, "told to fail with status %d", (int)kind);
}

const ModelOps MODEL = {.begin = begin, .output = output, .step = step};
