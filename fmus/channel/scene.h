/* The vehicles and buildings of the inputs, checked and indexed. */
#ifndef SCENE_H
#define SCENE_H
#include "antenna.h"
#include "building_shadowing.h"
#include "fmi3_model.h"
#include "parameters.h"
#include "vehicle_shadowing.h"

/* A copy of some inputs, to tell whether they have changed. */
typedef struct { uint8_t *bytes; size_t size, capacity; } InputCopy;

typedef struct {
    size_t count;
    int64_t *id; /* ascending */
    Antenna *antenna;
    bool *equipped;
    Bodies bodies;
    Buildings buildings;
    InputCopy vehicle_inputs, building_inputs;
    bool is_stale; /* nothing is known about the inputs that the scene was made from */
    size_t id_capacity, antenna_capacity, equipped_capacity;
} Scene;

#define NO_INDEX SIZE_MAX

/* Coordinates beyond this are taken for garbage [m]. */
#define FARTHEST 1e8

/* Adopt the inputs. `changed` tells whether anything differs from the last time. An error names the
 * variable, the element and what is wrong with it. */
ModelStatus scene_update(Instance *, Scene *, const Parameters *, bool *changed);
void scene_free(Scene *);

/* Whether all elements of a Float64 input of rows of `columns` lie between `low` and `high`; NaN does
 * not. */
ModelStatus check_range(Instance *, const char *name, uint32_t reference, size_t columns, double low,
                        double high);

/* Index of a vehicle, or NO_INDEX. */
size_t scene_find(const Scene *, int64_t id);

#endif
