#include "scene.h"
#include "buffer.h"
#include "variables.h"
#include <math.h>
#include <string.h>

typedef struct { uint32_t reference; size_t size; } Input;

static ModelStatus out_of_memory(Instance *i) {
    return model_log(i, MODEL_ERROR, "memory is short for this number of vehicles or buildings");
}

/* Bring the copy up to date; `changed` is set if it was not. */
static ModelStatus copy_inputs(Instance *i, InputCopy *copy, const Input *input, size_t inputs,
                               bool *changed) {
    size_t size = 0;
    for (size_t k = 0; k < inputs; k++) size += variable_length(i, input[k].reference) * input[k].size;
    if (BUFFER_RESERVE(copy->bytes, copy->capacity, size)) return out_of_memory(i);
    *changed |= size != copy->size;
    copy->size = size;
    uint8_t *at = copy->bytes;
    for (size_t k = 0; k < inputs; k++) {
        size_t part = variable_length(i, input[k].reference) * input[k].size;
        if (part == 0) continue;
        const void *data = variable_data(i, input[k].reference);
        if (*changed || memcmp(at, data, part) != 0) {
            memcpy(at, data, part);
            *changed = true;
        }
        at += part;
    }
    return MODEL_OK;
}

ModelStatus check_range(Instance *i, const char *name, uint32_t reference, size_t columns, double low,
                        double high) {
    const double *value = variable_data(i, reference);
    size_t n = variable_length(i, reference);
    for (size_t k = 0; k < n; k++) {
        if (value[k] >= low && value[k] <= high) continue;
        if (columns == 1)
            return model_log(i, MODEL_ERROR, "%s[%zu] is %g; it must lie between %g and %g", name, k,
                             value[k], low, high);
        return model_log(i, MODEL_ERROR, "%s[%zu, %zu] is %g; it must lie between %g and %g", name,
                         k / columns, k % columns, value[k], low, high);
    }
    return MODEL_OK;
}

static ModelStatus check_vehicles(Instance *i) {
    const int64_t *id = variable_data(i, VR_vehicle_id);
    size_t n = variable_length(i, VR_vehicle_id);
    for (size_t k = 0; k < n; k++) {
        if (id[k] < 0 || id[k] > INT32_MAX)
            return model_log(i, MODEL_ERROR, "vehicle.id[%zu] is %lld; ids are 0 to 2147483647", k,
                             (long long)id[k]);
        if (k > 0 && id[k] <= id[k - 1])
            return model_log(i, MODEL_ERROR, "vehicle.id[%zu] is %lld after %lld; ids must ascend", k,
                             (long long)id[k], (long long)id[k - 1]);
    }
    ModelStatus status =
        check_range(i, "vehicle.position", VR_vehicle_position, 3, -FARTHEST, FARTHEST);
    if (status == MODEL_OK)
        status = check_range(i, "vehicle.heading", VR_vehicle_heading, 1, -FARTHEST, FARTHEST);
    if (status == MODEL_OK) status = check_range(i, "vehicle.size", VR_vehicle_size, 3, 0, FARTHEST);
    if (status == MODEL_OK)
        status = check_range(i, "vehicle.antenna_height", VR_vehicle_antenna_height, 1, 0, FARTHEST);
    return status;
}

static bool shadows(const Parameters *p, bool equipped, const double size[3]) {
    return (equipped || p->unequipped_shadow) && size[1] >= p->shadow_width;
}

static ModelStatus read_vehicles(Instance *i, Scene *s, const Parameters *p) {
    size_t n = variable_length(i, VR_vehicle_id), bodies = 0;
    if (BUFFER_RESERVE(s->id, s->id_capacity, n)
        || BUFFER_RESERVE(s->antenna, s->antenna_capacity, n)
        || BUFFER_RESERVE(s->equipped, s->equipped_capacity, n))
        return out_of_memory(i);
    const int64_t *id = variable_data(i, VR_vehicle_id);
    const double *position = variable_data(i, VR_vehicle_position);
    const double *heading = variable_data(i, VR_vehicle_heading);
    const double *size = variable_data(i, VR_vehicle_size);
    const double *own_height = variable_data(i, VR_vehicle_antenna_height);
    const bool *equipped = variable_data(i, VR_vehicle_equipped);
    for (size_t k = 0; k < n; k++) {
        const double *at = position + 3 * k;
        double height = p->antenna_height > 0 ? p->antenna_height : own_height[k];
        double ahead = p->antenna_in_front ? size[3 * k] / 2 : 0, direction[2];
        unit_vector(heading[k], direction);
        s->id[k] = id[k];
        s->equipped[k] = equipped[k];
        s->antenna[k] = (Antenna){
            .at = {at[0] + ahead * direction[0], at[1] + ahead * direction[1], at[2] + height},
            .height = height,
            .heading = heading[k],
            .body = shadows(p, equipped[k], size + 3 * k) ? bodies++ : NO_BODY,
        };
    }
    s->count = n;
    if (bodies_resize(&s->bodies, bodies)) return out_of_memory(i);
    for (size_t k = 0; k < n; k++) {
        if (s->antenna[k].body == NO_BODY) continue;
        Position center = {position[3 * k], position[3 * k + 1], position[3 * k + 2]};
        bodies_put(&s->bodies, s->antenna[k].body, center, heading[k], size + 3 * k);
    }
    return bodies_index(&s->bodies) ? out_of_memory(i) : MODEL_OK;
}

/* Buildings are numbered 0 to n_building - 1, in this order, and have three corners at least. */
static ModelStatus check_rings(Instance *i) {
    const int32_t *index = variable_data(i, VR_building_index);
    size_t corners = variable_length(i, VR_building_index);
    size_t buildings = variable_length(i, VR_building_height);
    for (size_t k = 0; k < corners; k++) {
        if (index[k] < 0 || (size_t)index[k] >= buildings)
            return model_log(i, MODEL_ERROR, "building.index[%zu] is %d; there are %zu buildings", k,
                             (int)index[k], buildings);
        if (k > 0 && index[k] < index[k - 1])
            return model_log(i, MODEL_ERROR, "building.index[%zu] is %d after %d; it must ascend", k,
                             (int)index[k], (int)index[k - 1]);
    }
    size_t corner = 0;
    for (size_t building = 0; building < buildings; building++) {
        size_t first = corner;
        while (corner < corners && (size_t)index[corner] == building) corner++;
        if (corner - first < 3)
            return model_log(i, MODEL_ERROR,
                             "building.index names building %zu %zu times; a building has at least "
                             "3 corners", building, corner - first);
    }
    return MODEL_OK;
}

static ModelStatus read_buildings(Instance *i, Scene *s) {
    ModelStatus status =
        check_range(i, "building.vertex", VR_building_vertex, 2, -FARTHEST, FARTHEST);
    if (status == MODEL_OK)
        status = check_range(i, "building.height", VR_building_height, 1, 0, INFINITY);
    if (status == MODEL_OK) status = check_rings(i);
    if (status != MODEL_OK) return status;
    int failed = buildings_set(&s->buildings, variable_data(i, VR_building_vertex),
                               variable_data(i, VR_building_index),
                               variable_length(i, VR_building_index),
                               variable_data(i, VR_building_height),
                               variable_length(i, VR_building_height));
    return failed ? out_of_memory(i) : MODEL_OK;
}

ModelStatus scene_update(Instance *i, Scene *s, const Parameters *p, bool *changed) {
    static const Input VEHICLES[] = {
        {VR_vehicle_id, sizeof(int64_t)},      {VR_vehicle_position, sizeof(double)},
        {VR_vehicle_heading, sizeof(double)},  {VR_vehicle_size, sizeof(double)},
        {VR_vehicle_antenna_height, sizeof(double)}, {VR_vehicle_equipped, sizeof(bool)},
    };
    static const Input BUILDINGS[] = {
        {VR_building_vertex, sizeof(double)},
        {VR_building_index, sizeof(int32_t)},
        {VR_building_height, sizeof(double)},
    };
    bool vehicles_changed = s->is_stale, buildings_changed = s->is_stale;
    s->is_stale = true; /* until all went well */
    ModelStatus status = copy_inputs(i, &s->vehicle_inputs, VEHICLES,
                                     sizeof VEHICLES / sizeof *VEHICLES, &vehicles_changed);
    if (status == MODEL_OK)
        status = copy_inputs(i, &s->building_inputs, BUILDINGS, sizeof BUILDINGS / sizeof *BUILDINGS,
                             &buildings_changed);
    if (status == MODEL_OK && vehicles_changed) status = check_vehicles(i);
    if (status == MODEL_OK && vehicles_changed) status = read_vehicles(i, s, p);
    if (status == MODEL_OK && buildings_changed) status = read_buildings(i, s);
    s->is_stale = status != MODEL_OK;
    *changed = vehicles_changed || buildings_changed;
    return status;
}

void scene_free(Scene *s) {
    free(s->id);
    free(s->antenna);
    free(s->equipped);
    free(s->vehicle_inputs.bytes);
    free(s->building_inputs.bytes);
    bodies_free(&s->bodies);
    buildings_free(&s->buildings);
    *s = (Scene){0};
}

size_t scene_find(const Scene *s, int64_t id) {
    size_t low = 0, high = s->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (s->id[middle] < id) low = middle + 1;
        else high = middle;
    }
    return low < s->count && s->id[low] == id ? low : NO_INDEX;
}
