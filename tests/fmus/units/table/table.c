#include <math.h>
#include <string.h>

#include "fmi3_model.h"
#include "variables.h"

enum { HOLD = 1, LINEAR };

static void copy(Instance *m, uint32_t from, uint32_t to) {
    memcpy(variable_data(m, to), variable_data(m, from), 8 * variable_length(m, from));
}

static ModelStatus output(Instance *m, void *state, double t) {
    (void)state, (void)t;
    const double *gain = variable_data(m, VR_sample_gain);
    double last = (double)variable_length(m, VR_sample_gain) - 1;
    double position = fmin(fmax(*(double *)variable_data(m, VR_position), 0), last);
    size_t before = (size_t)position, after = (size_t)fmin((double)before + 1, last);
    double rest = position - (double)before, *found = variable_data(m, VR_gain);
    switch (*(int64_t *)variable_data(m, VR_interpolation)) {
        case HOLD: *found = gain[before]; break;
        case LINEAR: *found = gain[before] + rest * (gain[after] - gain[before]); break;
        default: return model_log(m, MODEL_FATAL, "the shell let a wrong item pass");
    }
    copy(m, VR_sample_corner, VR_corner);
    copy(m, VR_sample_colour, VR_colour);
    return MODEL_OK;
}

static ModelStatus step(Instance *m, void *state, double t, double h) {
    return output(m, state, t + h);
}

const ModelOps MODEL = {.output = output, .step = step};
