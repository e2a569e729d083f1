/* The perception unit: from points to abstract perception matrices, objects, blind zones and
 * matches. This file connects the parts with the FMI variables; docs/physics-perception.md
 * explains them. */
#include "settings.h"
#include "state.h"
#include "variables.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static ModelStatus begin(Instance *instance, void *state, double t) {
    (void)state, (void)t;
    const Settings settings = settings_of(instance);
    Problem problem;
    return settings_check(&settings, &problem)
               ? model_log(instance, MODEL_ERROR, "%s", problem.text)
               : MODEL_OK;
}

/* ---- inputs --------------------------------------------------------------------------------- */

/* Everything of one step that the stages hand on. */
typedef struct {
    Settings settings;
    int64_t now, ego; /* [ns], vehicle */
    Cloud cloud;
    Messages messages;
    Road road;
    Route route;
    uint32_t scans; /* that were processed */
    int sees_ego; /* whether the ego vehicle has a scan: then `pose` and the zones are its own */
    Pose pose;
} Step;

/* One corner is no road: FMI wants arrays to start with an element. */
static int read_map(Instance *instance, Step *step, Problem *problem) {
    step->route = (Route){.vertex = variable_data(instance, VR_route_vertex),
                          .count = variable_length(instance, VR_route_vertex) / 2};
    step->road = (Road){.vertex = variable_data(instance, VR_road_vertex),
                        .index = variable_data(instance, VR_road_index),
                        .count = variable_length(instance, VR_road_index)};
    if (step->road.count == 1) step->road.count = 0;
    return route_check(&step->route, problem) || road_check(&step->road, problem);
}

/* Read and check all inputs before anything changes. */
static int read_inputs(Instance *instance, Perception *state, double t, Step *step,
                       Problem *problem) {
    if (!(fabs(t) < 4e9)) return fail(problem, "the time is %g s, must be within 4e9 s of 0", t);
    step->settings = settings_of(instance);
    step->now = nanoseconds(t);
    step->ego = int64(instance, VR_ego_id);
    const Binary *points = variable_binary(instance, VR_points);
    const Binary *received = variable_binary(instance, VR_received);
    if (cloud_open(&step->cloud, points->data, points->size, problem)) return 1;
    if (map_open(&state->map, variable_data(instance, VR_building_vertex),
                 variable_data(instance, VR_building_index),
                 variable_length(instance, VR_building_index), problem))
        return 1;
    Problem reason;
    if (messages_open(&step->messages, received->data, received->size, &reason))
        return fail(problem, "received: %.200s", reason.text);
    return read_map(instance, step, problem);
}

/* ---- stages --------------------------------------------------------------------------------- */

static int append(Bytes *bytes, const void *source, size_t size, Problem *problem) {
    if (reserve(&bytes->data, &bytes->capacity, bytes->size + size, 1, problem)) return 1;
    if (size) memcpy(bytes->data + bytes->size, source, size);
    bytes->size += size;
    return 0;
}

/* What one sensor sees: its objects and its matrix; the blind zones if it is the ego's. */
static int perceive(Perception *state, Step *step, const Sensor *sensor, Problem *problem) {
    const Settings *settings = &step->settings;
    const size_t start = state->apms_out.size;
    if (tracks_newest(&state->tracks, sensor->vehicle) > sensor->time)
        return fail(problem, "points: the scan of vehicle %lld at %lld ns is older than its last",
                    (long long)sensor->vehicle, (long long)sensor->time);
    if (scan_take(&state->scan, &settings->matrix, &step->cloud, sensor, &state->map, problem)
        || (settings->matrix.levels
            && seen_take(&state->seen, &settings->pattern, &settings->matrix, &step->cloud, sensor,
                         settings->matrix.levels, state->scan.cells, problem))
        || objects_detect(&state->objects, &state->tracks, &settings->object, sensor, &state->scan,
                          problem)
        || append(&state->objects_out, state->objects.objects,
                  state->objects.count * sizeof(Object), problem)
        || apm_append(&state->apms_out, &state->layer, &settings->matrix, sensor, &state->scan,
                      settings->has_layer ? &state->objects : NULL, problem)
        || (settings->is_compressed && apm_compress(&state->apms_out, start, problem)))
        return 1;
    if (sensor->vehicle != step->ego) return 0;
    step->sees_ego = 1;
    step->pose = state->scan.pose;
    return region_make(&state->region, &settings->region, &settings->matrix, &step->pose,
                       &step->road, &step->route, problem)
           || zones_find(&state->zones, &settings->zone, &settings->matrix, &state->scan,
                         &state->region, problem);
}

static int perceive_all(Perception *state, Step *step, Problem *problem) {
    const Frame blank = {{0}, 0, 0, 0};
    int64_t newest = INT64_MIN;
    state->apms_out.size = state->objects_out.size = state->zones.count = 0;
    if (append(&state->apms_out, &blank, sizeof blank, problem)
        || append(&state->objects_out, &blank, sizeof blank, problem))
        return 1;
    for (size_t i = 0; i < step->cloud.sensor_count; i++) {
        Sensor sensor = cloud_sensor(&step->cloud, i);
        if (sensor.time > newest) newest = sensor.time;
        if (step->settings.is_ego_alone && sensor.vehicle != step->ego) continue;
        step->scans++;
        if (perceive(state, step, &sensor, problem)) return 1;
    }
    if (newest < 0) return 0; /* no scan */
    tracks_forget(&state->tracks, &step->settings.object.track, newest);
    return 0;
}

/* Remember what was received; malformed messages are logged and dropped, for radio data must not
 * stop a receiver. */
static ModelStatus receive_all(Instance *instance, Perception *state, Step *step) {
    ModelStatus status = MODEL_OK;
    const uint8_t *message;
    size_t size;
    for (size_t i = 0; messages_next(&step->messages, &message, &size); i++) {
        Problem problem;
        Fate fate = match_receive(&state->match, &step->settings.match, step->now, message, size,
                                  &problem);
        if (fate == NO_MEMORY)
            return model_log(instance, MODEL_ERROR, "received: %s", problem.text);
        if (fate == DROPPED)
            status = model_log(instance, MODEL_WARNING, "received: message %zu is dropped: %s", i,
                               problem.text);
    }
    match_forget(&state->match, &step->settings.match, step->now);
    return status;
}

static int rank(Instance *instance, Perception *state, const Step *step, Problem *problem) {
    size_t zones = variable_length(instance, VR_blind_zone_range);
    if (zones < state->zones.count) state->zones.count = zones;
    if (!step->sees_ego) {
        match_release(&state->match);
        return 0;
    }
    return demand_make(&state->demand, &step->settings.matrix, &state->zones, state->zones.count,
                       &state->region, step->settings.has_region_benefit, problem)
           || match_rank(&state->match, &step->settings.match, step->now, step->ego, &step->pose,
                         &state->demand, variable_length(instance, VR_match_sharer), problem);
}

/* ---- outputs -------------------------------------------------------------------------------- */

/* Publish frame and records; the frame's place is already at the start of `bytes`. */
static int publish(Instance *instance, uint32_t reference, const Bytes *bytes, Frame frame,
                   Problem *problem) {
    Binary *out = variable_binary(instance, reference);
    if (binary_reserve(out, bytes->size))
        return fail(problem, "out of memory for %zu bytes", bytes->size);
    memcpy(out->data, bytes->data, bytes->size);
    memcpy(out->data, &frame, sizeof frame);
    out->size = bytes->size;
    return 0;
}

static void publish_zones(Instance *instance, const Zones *zones, const Pose *pose) {
    double *center = variable_data(instance, VR_blind_zone_center);
    double *range = variable_data(instance, VR_blind_zone_range);
    size_t count = variable_length(instance, VR_blind_zone_range);
    for (size_t i = 0; i < count; i++) {
        int is_used = i < zones->count;
        Zone zone = is_used ? zones->zones[i] : (Zone){0};
        double x = pose->cosine * zone.center[0] - pose->sine * zone.center[1];
        double y = pose->sine * zone.center[0] + pose->cosine * zone.center[1];
        center[2 * i] = is_used ? pose->center[0] + x : 0.0;
        center[2 * i + 1] = is_used ? pose->center[1] + y : 0.0;
        range[i] = zone.range;
    }
}

static void publish_match(Instance *instance, const Match *match) {
    int64_t *sharer = variable_data(instance, VR_match_sharer);
    double *benefit = variable_data(instance, VR_match_benefit);
    size_t count = variable_length(instance, VR_match_sharer);
    for (size_t i = 0; i < count; i++) {
        int is_used = i < match->sharer_count;
        sharer[i] = is_used ? match->sharers[i].vehicle : NO_VEHICLE;
        benefit[i] = is_used ? match->sharers[i].benefit : 0.0;
    }
    *(bool *)variable_data(instance, VR_match_trigger) = match->sharer_count > 0;
}

static int publish_all(Instance *instance, const Perception *state, const Step *step,
                       Problem *problem) {
    uint32_t objects = (uint32_t)((state->objects_out.size - sizeof(Frame)) / sizeof(Object));
    Frame apms_frame = {{'A', 'P', 'M', 'S'}, 1, step->scans, 0};
    Frame objects_frame = {{'O', 'B', 'J', 'S'}, 1, objects, sizeof(Object)};
    if (publish(instance, VR_apms, &state->apms_out, apms_frame, problem)
        || publish(instance, VR_objects, &state->objects_out, objects_frame, problem))
        return 1;
    publish_zones(instance, &state->zones, &step->pose);
    publish_match(instance, &state->match);
    return 0;
}

/* ---- FMI ------------------------------------------------------------------------------------ */

static ModelStatus output(Instance *instance, void *pointer, double t) {
    Perception *state = pointer;
    Problem problem;
    Step step = {0};
    if (read_inputs(instance, state, t, &step, &problem) || perceive_all(state, &step, &problem))
        return model_log(instance, MODEL_ERROR, "%s", problem.text);
    ModelStatus status = receive_all(instance, state, &step);
    if (status >= MODEL_ERROR) return status;
    if (rank(instance, state, &step, &problem) || publish_all(instance, state, &step, &problem))
        return model_log(instance, MODEL_ERROR, "%s", problem.text);
    return status;
}

static ModelStatus step(Instance *instance, void *state, double t, double h) {
    return output(instance, state, t + h);
}

static ModelStatus create(Instance *instance, void **state) {
    *state = calloc(1, sizeof(Perception));
    return *state ? MODEL_OK : model_log(instance, MODEL_FATAL, "out of memory");
}

static void destroy(Instance *instance, void *pointer) {
    (void)instance;
    Perception *state = pointer;
    if (!state) return;
    tracks_free(&state->tracks);
    map_free(&state->map);
    match_free(&state->match);
    scan_free(&state->scan);
    seen_free(&state->seen);
    objects_free(&state->objects);
    free(state->layer.cells);
    region_free(&state->region);
    zones_free(&state->zones);
    demand_free(&state->demand);
    free(state->apms_out.data);
    free(state->objects_out.data);
    free(state);
}

static size_t save(Instance *instance, void *state, uint8_t *bytes) {
    (void)instance;
    return state_save(state, bytes);
}

static ModelStatus load(Instance *instance, void *state, const uint8_t *bytes, size_t size) {
    Problem problem;
    if (state_load(state, bytes, size, &problem))
        return model_log(instance, MODEL_ERROR, "%s", problem.text);
    return MODEL_OK;
}

const ModelOps MODEL = {create, destroy, begin, output, step, save, load};
