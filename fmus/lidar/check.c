#include "check.h"

#include <math.h>

#include "portable_math.h"
#include "records.h"

/* Beyond these a number is a mistake, and squares and differences of coordinates lose precision. */
static const double COORDINATE_LIMIT = 1e8, LENGTH_LIMIT = 1e4; /* [m] */

static int is_coordinate(double value) {
    return fabs(value) <= COORDINATE_LIMIT; /* false for NaN */
}

static int is_length(double value) {
    return value > 0.0 && value <= LENGTH_LIMIT;
}

ModelStatus check_parameters(Instance *instance, const PatternParameters *p) {
    if (p->channels > 1 && !(p->elevation_bottom < p->elevation_top))
        return model_log(instance, MODEL_ERROR,
                         "elevation_bottom is %g rad; it must be less than elevation_top, %g rad",
                         p->elevation_bottom, p->elevation_top);
    return MODEL_OK;
}

static ModelStatus check_vehicle(Instance *instance, const Vehicles *v, size_t i) {
    if (v->id[i] < 0 || v->id[i] > INT32_MAX)
        return model_log(instance, MODEL_ERROR, "vehicle.id[%zu] is %lld; ids are 0 ... 2147483647",
                         i, (long long)v->id[i]);
    if (i > 0 && v->id[i] <= v->id[i - 1])
        return model_log(instance, MODEL_ERROR,
                         "vehicle.id[%zu] is %lld after %lld; ids must ascend, each once", i,
                         (long long)v->id[i], (long long)v->id[i - 1]);
    for (size_t k = 0; k < 3; k++) {
        double position = v->position[3 * i + k], size = v->size[3 * i + k];
        if (!is_coordinate(position))
            return model_log(instance, MODEL_ERROR,
                             "vehicle.position[%zu, %zu] is %g; coordinates must be finite and "
                             "within +-%g m",
                             i, k, position, COORDINATE_LIMIT);
        if (!is_length(size))
            return model_log(instance, MODEL_ERROR,
                             "vehicle.size[%zu, %zu] is %g; length, width and height must be "
                             "positive and at most %g m",
                             i, k, size, LENGTH_LIMIT);
    }
    if (!(fabs(v->heading[i]) <= ANGLE_LIMIT))
        return model_log(instance, MODEL_ERROR,
                         "vehicle.heading[%zu] is %g; it must be finite and within +-%g rad", i,
                         v->heading[i], ANGLE_LIMIT);
    if (v->body[i] < 0 || v->body[i] >= BODY_CLASSES)
        return model_log(instance, MODEL_ERROR,
                         "vehicle.body[%zu] is %ld; it must be one of " BODY_CODES, i,
                         (long)v->body[i]);
    return MODEL_OK;
}

ModelStatus check_vehicles(Instance *instance, const Vehicles *vehicles) {
    for (size_t i = 0; i < vehicles->count; i++) {
        ModelStatus status = check_vehicle(instance, vehicles, i);
        if (status != MODEL_OK)
            return status;
    }
    return MODEL_OK;
}

static ModelStatus check_vertex(Instance *instance, const Buildings *b, size_t i) {
    for (size_t k = 0; k < 2; k++)
        if (!is_coordinate(b->vertex[2 * i + k]))
            return model_log(instance, MODEL_ERROR,
                             "building.vertex[%zu, %zu] is %g; coordinates must be finite and "
                             "within +-%g m",
                             i, k, b->vertex[2 * i + k], COORDINATE_LIMIT);
    if (b->index[i] < 0 || (size_t)b->index[i] >= b->count)
        return model_log(instance, MODEL_ERROR,
                         "building.index[%zu] is %ld; there are %zu buildings, counted from 0", i,
                         (long)b->index[i], b->count);
    if (i > 0 && b->index[i] < b->index[i - 1])
        return model_log(instance, MODEL_ERROR,
                         "building.index[%zu] is %ld after %ld; it must not descend", i,
                         (long)b->index[i], (long)b->index[i - 1]);
    return MODEL_OK;
}

/* Called with the indices known to ascend within 0 ... count - 1. */
static ModelStatus check_rings(Instance *instance, const Buildings *b) {
    size_t vertex = 0;
    for (size_t building = 0; building < b->count; building++) {
        size_t corners = 0;
        for (; vertex < b->vertex_count && (size_t)b->index[vertex] == building; vertex++)
            corners++;
        if (corners < 3)
            return model_log(instance, MODEL_ERROR,
                             "building %zu has %zu corners in building.index; it needs 3 or more",
                             building, corners);
        if (!is_length(b->height[building]))
            return model_log(instance, MODEL_ERROR,
                             "building.height[%zu] is %g; heights must be positive and at most "
                             "%g m",
                             building, b->height[building], LENGTH_LIMIT);
    }
    return MODEL_OK;
}

ModelStatus check_buildings(Instance *instance, const Buildings *buildings) {
    for (size_t i = 0; i < buildings->vertex_count; i++) {
        ModelStatus status = check_vertex(instance, buildings, i);
        if (status != MODEL_OK)
            return status;
    }
    return check_rings(instance, buildings);
}
