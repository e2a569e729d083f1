/* The lidar unit: one scan of every sensor at each communication point. It has no state that
 * survives a step: what is kept between steps is memory, and tables that follow from parameters. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "cloud.h"
#include "fmi3_model.h"
#include "pattern.h"
#include "random.h"
#include "raster.h"
#include "records.h"
#include "scene.h"
#include "variables.h"
#include "view.h"

typedef struct {
    Pattern pattern;
    Scene scene;
    View view;
    Hits hits;
} Lidar;

/* The parameters that the pattern does not know. */
typedef struct {
    Noise noise;
    double mount_height;
    int64_t seed;
} Mounting;

static const double TIME_LIMIT = 9e9; /* [s]; the time in nanoseconds is an int64_t */

static ModelStatus out_of_memory(Instance *instance, const char *what) {
    return model_log(instance, MODEL_ERROR, "not enough memory for %s", what);
}

static PatternParameters read_pattern(Instance *instance) {
    return (PatternParameters){
        .channels = natural(instance, VR_channels),
        .azimuths = natural(instance, VR_azimuths),
        .elevation_top = real(instance, VR_elevation_top),
        .elevation_bottom = real(instance, VR_elevation_bottom),
        .pitch = real(instance, VR_pitch),
        .roll = real(instance, VR_roll),
        .range = real(instance, VR_range),
    };
}

static Mounting read_mounting(Instance *instance) {
    return (Mounting){
        .noise = {.range_noise = real(instance, VR_range_noise),
                  .dropout = real(instance, VR_dropout)},
        .mount_height = real(instance, VR_mount_height),
        .seed = int64(instance, VR_seed),
    };
}

static Vehicles read_vehicles(Instance *instance) {
    return (Vehicles){
        .count = variable_length(instance, VR_vehicle_id),
        .id = variable_data(instance, VR_vehicle_id),
        .position = variable_data(instance, VR_vehicle_position),
        .heading = variable_data(instance, VR_vehicle_heading),
        .size = variable_data(instance, VR_vehicle_size),
        .body = variable_data(instance, VR_vehicle_body),
        .lidar = variable_data(instance, VR_vehicle_lidar),
    };
}

static Buildings read_buildings(Instance *instance) {
    return (Buildings){
        .vertex_count = variable_length(instance, VR_building_index),
        .count = variable_length(instance, VR_building_height),
        .vertex = variable_data(instance, VR_building_vertex),
        .index = variable_data(instance, VR_building_index),
        .height = variable_data(instance, VR_building_height),
    };
}

/* Scan with one sensor: append its points to `out` and fill in its record. */
static int scan(Lidar *lidar, const Vehicles *vehicles, size_t v, const Mounting *mounting,
                Sensor *sensor, Binary *out) {
    const PatternParameters *p = &lidar->pattern.parameters;
    const double *position = vehicles->position + 3 * v;
    sensor->vehicle = vehicles->id[v];
    sensor->position[0] = position[0];
    sensor->position[1] = position[1];
    sensor->position[2] = position[2] + vehicles->size[3 * v + 2] + mounting->mount_height;
    sensor->heading = vehicles->heading[v];
    sensor->pitch = p->pitch;
    sensor->roll = p->roll;
    Viewpoint from = {.heading = sensor->heading, .vehicle = v};
    memcpy(from.position, sensor->position, sizeof from.position);
    if (view_build(&lidar->view, &lidar->scene, &from, &lidar->pattern)
        || trace(&lidar->view, &lidar->pattern, &lidar->hits)
        || binary_reserve(out, out->size + (size_t)p->azimuths * p->channels * sizeof(Point)))
        return 1;
    uint64_t key = scan_key(mounting->seed, sensor->time, sensor->vehicle);
    /* records start at multiples of 4 bytes from the start of the allocated block */
    Point *points = (Point *)(void *)(out->data + out->size);
    uint32_t count = 0;
    for (uint32_t azimuth = 0; azimuth < p->azimuths; azimuth++)
        count += cloud_points(&lidar->view, &lidar->pattern, &lidar->hits, azimuth,
                              &mounting->noise, key, points + count);
    sensor->count = count;
    out->size += (size_t)count * sizeof(Point);
    return 0;
}

static ModelStatus scan_all(Instance *instance, Lidar *lidar, const Vehicles *vehicles,
                            int64_t time) {
    Binary *out = variable_binary(instance, VR_points);
    Mounting mounting = read_mounting(instance);
    Frame frame = {{'L', 'P', 'T', 'S'}, 1, 0, sizeof(Sensor)};
    for (size_t v = 0; v < vehicles->count; v++)
        frame.count += vehicles->lidar[v];
    out->size = 0;
    if (binary_reserve(out, sizeof frame + frame.count * sizeof(Sensor)))
        return out_of_memory(instance, "the sensors' records");
    memcpy(out->data, &frame, sizeof frame);
    out->size = sizeof frame + frame.count * sizeof(Sensor);
    uint64_t first = 0;
    size_t record = sizeof frame;
    for (size_t v = 0; v < vehicles->count; v++) {
        if (!vehicles->lidar[v])
            continue;
        Sensor sensor = {.time = time, .first = (uint32_t)first};
        if (scan(lidar, vehicles, v, &mounting, &sensor, out))
            return out_of_memory(instance, "the points");
        memcpy(out->data + record, &sensor, sizeof sensor);
        record += sizeof sensor;
        first += sensor.count;
        if (first > UINT32_MAX)
            return model_log(instance, MODEL_ERROR,
                             "the sensors see more than 4294967295 points; let fewer vehicles "
                             "carry one (vehicle.lidar), or lower channels or azimuths");
    }
    return MODEL_OK;
}

static ModelStatus output(Instance *instance, void *state, double t) {
    Lidar *lidar = state;
    if (!(fabs(t) <= TIME_LIMIT))
        return model_log(instance, MODEL_ERROR, "time is %g s; it must be within +-%g s", t,
                         TIME_LIMIT);
    PatternParameters parameters = read_pattern(instance);
    Vehicles vehicles = read_vehicles(instance);
    Buildings buildings = read_buildings(instance);
    ModelStatus status = check_parameters(instance, &parameters);
    if (status == MODEL_OK)
        status = check_vehicles(instance, &vehicles);
    if (status == MODEL_OK)
        status = check_buildings(instance, &buildings);
    if (status != MODEL_OK)
        return status;
    if (pattern_prepare(&lidar->pattern, &parameters)
        || scene_build(&lidar->scene, &vehicles, &buildings))
        return out_of_memory(instance, "the scene");
    return scan_all(instance, lidar, &vehicles, (int64_t)llround(t * 1e9));
}

static ModelStatus create(Instance *instance, void **state) {
    *state = calloc(1, sizeof(Lidar));
    return *state != NULL ? MODEL_OK : out_of_memory(instance, "the instance");
}

static void destroy(Instance *instance, void *state) {
    (void)instance;
    Lidar *lidar = state;
    if (lidar == NULL)
        return;
    pattern_clear(&lidar->pattern);
    scene_clear(&lidar->scene);
    view_clear(&lidar->view);
    hits_clear(&lidar->hits);
    free(lidar);
}

static ModelStatus step(Instance *instance, void *state, double t, double h) {
    return output(instance, state, t + h);
}

const ModelOps MODEL = {
    .create = create, .destroy = destroy, .output = output, .step = step};
