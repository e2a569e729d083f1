/* A short life of the perception unit with all that takes memory: sensors that come and go, a road,
 * a route, received matrices, pose errors, states that go to another instance. Linked with the
 * sources of the unit and of the shell.
 *
 *     sighted          lives once
 *     sighted starved  lives again and again, each time with the next allocation failing
 *
 * Nothing may crash, nothing may leak; with enough memory everything must succeed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "records.h"
#include "starving.h"
#include "variables.h"

static int differences;
static size_t zones, sharers;
static int64_t kind_of_index; /* 1: points; 2: seen_area */

/* ---- inputs ---- */

enum { SENSORS = 3, POINTS = 400, ROAD = 12, ROUTE = 3, BUILDINGS = 7 };

/* Sensors `first` to before SENSORS, side by side; each sees a ring of ground and a few bodies. */
static void set_points(fmi3Instance c, uint32_t first, int64_t time) {
    struct { Frame head; Sensor sensor[SENSORS]; Point point[SENSORS * POINTS]; } signal;
    memset(&signal, 0, sizeof signal);
    uint32_t count = SENSORS - first;
    Point *point = (Point *)(void *)&signal.sensor[count];
    signal.head = (Frame){{'L', 'P', 'T', 'S'}, 1, count, sizeof(Sensor)};
    for (uint32_t k = 0; k < count; k++) {
        int64_t vehicle = first + k;
        signal.sensor[k] = (Sensor){.vehicle = vehicle, .time = time,
                                    .position = {12.0 * (double)vehicle, 5, 2},
                                    .heading = 0.3 * (double)vehicle,
                                    .first = k * POINTS, .count = POINTS};
        for (int i = 0; i < POINTS; i++, point++) {
            int body = i % 40;
            double angle = 0.0157 * i, range = body < 9 ? 8.0 + body : 10.0 + 0.05 * i;
            *point = (Point){.position = {(float)(range * cos(angle)), (float)(range * sin(angle)),
                                          body < 9 ? -1.0f : -2.0f},
                             .instance = body < 9 ? 10 + i / 40 : GROUND};
        }
    }
    size_t size = sizeof(Frame) + count * (sizeof(Sensor) + POINTS * sizeof(Point));
    set_binary(c, VR_points, &signal, size);
}

static void set_map(fmi3Instance c, uint64_t corners, uint64_t route) {
    static const double ROAD_VERTEX[ROAD][2] = {
        {-40, -5}, {80, -5}, {80, 15}, {-40, 15}, {0, -60}, {20, -60},
        {20, 60},  {0, 60},  {0, 0},   {50, 50},  {50, 0},  {0, 50}};
    static const int32_t ROAD_INDEX[ROAD] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2};
    static const double ROUTE_VERTEX[ROUTE][2] = {{0, 5}, {30, 5}, {30, 60}};
    const fmi3ValueReference index = VR_road_index, building = VR_building_index;
    static const double BUILDING_VERTEX[BUILDINGS][2] = {
        {10, 9}, {14, 9}, {14, 13}, {-9, 0}, {-9, 4}, {-12, 2}, {-12, 0}};
    static const int32_t BUILDING_INDEX[BUILDINGS] = {0, 0, 0, 1, 1, 1, 1};
    const uint64_t buildings = corners > 4 ? BUILDINGS : 3;
    note(fmi3EnterConfigurationMode(c));
    set_length(c, VR_n_road_vertex, corners);
    set_length(c, VR_n_route_vertex, route);
    set_length(c, VR_n_building_vertex, buildings);
    note(fmi3ExitConfigurationMode(c));
    set_floats(c, VR_road_vertex, &ROAD_VERTEX[0][0], 2 * corners);
    note(fmi3SetInt32(c, &index, 1, ROAD_INDEX, corners));
    set_floats(c, VR_route_vertex, &ROUTE_VERTEX[0][0], 2 * route);
    set_floats(c, VR_building_vertex, &BUILDING_VERTEX[0][0], 2 * buildings);
    note(fmi3SetInt32(c, &building, 1, BUILDING_INDEX, buildings));
}

/* ---- life ---- */

static void begin(fmi3Instance c, uint64_t corners) {
    const fmi3ValueReference ego = VR_ego_id, fewest = VR_minimum_points, kind = VR_index;
    const int64_t first = 0;
    const int32_t one = 1;
    note(fmi3SetInt32(c, &fewest, 1, &one, 1)); /* many objects */
    set_float(c, VR_benefit_threshold, 0.0);
    set_float(c, VR_seen_benefit_threshold, 0.0);
    note(fmi3SetInt64(c, &kind, 1, &kind_of_index, 1));
    set_map(c, corners, corners > 4 ? ROUTE : 0);
    note(fmi3SetInt64(c, &ego, 1, &first, 1));
    initialise(c);
}

/* What one instance sends, the other receives; then both must publish the same. */
static void compare(fmi3Instance one, fmi3Instance two) {
    enum { MOST = 32 };
    const fmi3ValueReference outputs[] = {VR_apms, VR_objects};
    const fmi3ValueReference range = VR_blind_zone_range, sharer = VR_match_sharer;
    double ranges[2][MOST] = {{0}};
    int64_t ids[2][8] = {{0}};
    for (int k = 0; k < 2; k++) {
        size_t size = 0;
        differences += differ(one, two, outputs[k], &size);
        note(fmi3GetFloat64(k ? two : one, &range, 1, ranges[k], MOST));
        note(fmi3GetInt64(k ? two : one, &sharer, 1, ids[k], 8));
    }
    differences += memcmp(ranges[0], ranges[1], sizeof ranges[0]) != 0;
    differences += memcmp(ids[0], ids[1], sizeof ids[0]) != 0;
    for (int k = 0; k < MOST; k++) zones += ranges[0][k] > 0;
    for (int k = 0; k < 8; k++) sharers += ids[0][k] > 0;
}

static void receive(fmi3Instance from, fmi3Instance to) {
    fmi3Binary bytes;
    size_t size = get_binary(from, VR_apms, &bytes);
    uint8_t *copy = malloc(size ? size : 1);
    if (size) memcpy(copy, bytes, size);
    set_binary(to, VR_received, copy, size);
    free(copy);
}

static void live_together(fmi3Instance one, fmi3Instance two) {
    begin(one, 8);
    begin(two, 4);
    for (int k = 0; k < 4; k++) {
        set_points(one, k == 2 ? 1 : 0, k * 100000000LL);
        if (k == 3) set_map(one, ROAD, ROUTE);
        move_state(one, two);
        step(one, 0.1 * k, 0.1);
        step(two, 0.1 * k, 0.1);
        compare(one, two);
        receive(two, one);
    }
    note(fmi3Reset(two));
    note(fmi3Terminate(one));
}

static void live_once(void) { live_as_two("perception", live_together); }

int main(int count, char **arguments) {
    const int starves = shall_starve(count, arguments);
    for (kind_of_index = 1; kind_of_index <= 2; kind_of_index++) {
        if (!starves) live_once();
        else if (starve(live_once)) return 1;
    }
    if (starves) return 0;
    printf("%zu zones, %zu sharers, %d failures, %d differences\n", zones, sharers, failures,
           differences);
    return failures != 0 || differences != 0;
}
