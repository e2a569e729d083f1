#include "fmi3_model.h"
#include "variables.h"

static ModelStatus output(Instance *m, void *state, double t) {
    (void)state, (void)t;
    const double *w = variable_data(m, VR_w);
    const double *u = variable_data(m, VR_u);
    double *y = variable_data(m, VR_y);
    size_t columns = variable_length(m, VR_u);
    for (size_t i = 0; i < variable_length(m, VR_y); i++) {
        y[i] = 0;
        for (size_t k = 0; k < columns; k++) y[i] += w[i * columns + k] * u[k];
    }
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) { return output(m, state, t + h); }

const ModelOps MODEL = {.output = output, .step = step};
