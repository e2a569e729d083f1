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

static bool is_starved;
static int differences;
static size_t zones, sharers;
static int64_t kind_of_index; /* 1: points; 2: seen_area */

static void on_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                       fmi3String message) {
    (void)environment, (void)category;
    if (status >= fmi3Error && messages++ == 0 && !is_starved) printf("%s\n", message);
}

/* ---- inputs ---- */

enum { SENSORS = 3, POINTS = 400, ROAD = 12, ROUTE = 3, BUILDINGS = 7 };

static void set_binary(fmi3Instance c, fmi3ValueReference vr, const void *data, size_t size) {
    const fmi3Binary bytes = data;
    note(fmi3SetBinary(c, &vr, 1, &size, &bytes, 1));
}

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
    const fmi3ValueReference n_road = VR_n_road_vertex, n_route = VR_n_route_vertex;
    const fmi3ValueReference road = VR_road_vertex, index = VR_road_index, way = VR_route_vertex;
    static const double BUILDING_VERTEX[BUILDINGS][2] = {
        {10, 9}, {14, 9}, {14, 13}, {-9, 0}, {-9, 4}, {-12, 2}, {-12, 0}};
    static const int32_t BUILDING_INDEX[BUILDINGS] = {0, 0, 0, 1, 1, 1, 1};
    const fmi3ValueReference n_building = VR_n_building_vertex;
    const fmi3ValueReference corner = VR_building_vertex, building = VR_building_index;
    const uint64_t buildings = corners > 4 ? BUILDINGS : 3;
    note(fmi3EnterConfigurationMode(c));
    note(fmi3SetUInt64(c, &n_road, 1, &corners, 1));
    note(fmi3SetUInt64(c, &n_route, 1, &route, 1));
    note(fmi3SetUInt64(c, &n_building, 1, &buildings, 1));
    note(fmi3ExitConfigurationMode(c));
    note(fmi3SetFloat64(c, &road, 1, &ROAD_VERTEX[0][0], 2 * corners));
    note(fmi3SetInt32(c, &index, 1, ROAD_INDEX, corners));
    note(fmi3SetFloat64(c, &way, 1, &ROUTE_VERTEX[0][0], 2 * route));
    note(fmi3SetFloat64(c, &corner, 1, &BUILDING_VERTEX[0][0], 2 * buildings));
    note(fmi3SetInt32(c, &building, 1, BUILDING_INDEX, buildings));
}

/* ---- life ---- */

static fmi3Instance instantiate(void) {
    fmi3Instance c = fmi3InstantiateCoSimulation("perception", INSTANTIATION_TOKEN, NULL, false,
                                                 true, false, false, NULL, 0, NULL, on_message,
                                                 NULL);
    failures += c == NULL;
    return c;
}

static void set_parameter(fmi3Instance c, fmi3ValueReference vr, double value) {
    note(fmi3SetFloat64(c, &vr, 1, &value, 1));
}

static void initialise(fmi3Instance c, uint64_t corners) {
    const fmi3ValueReference ego = VR_ego_id, fewest = VR_minimum_points, kind = VR_index;
    const int64_t first = 0;
    const int32_t one = 1;
    note(fmi3SetInt32(c, &fewest, 1, &one, 1)); /* many objects */
    set_parameter(c, VR_position_error, 0.5);
    set_parameter(c, VR_pose_error_time, 2.0);
    set_parameter(c, VR_benefit_threshold, 0.0);
    set_parameter(c, VR_seen_benefit_threshold, 0.0);
    note(fmi3SetInt64(c, &kind, 1, &kind_of_index, 1));
    set_map(c, corners, corners > 4 ? ROUTE : 0);
    note(fmi3SetInt64(c, &ego, 1, &first, 1));
    note(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
    note(fmi3ExitInitializationMode(c));
}

static void step(fmi3Instance c, double t) {
    bool event, terminate, early;
    double last;
    note(fmi3DoStep(c, t, 0.1, true, &event, &terminate, &early, &last));
}

static size_t output(fmi3Instance c, fmi3ValueReference vr, fmi3Binary *bytes) {
    size_t size = 0;
    *bytes = NULL;
    note(fmi3GetBinary(c, &vr, 1, &size, bytes, 1));
    return size;
}

/* What one instance sends, the other receives; then both must publish the same. */
static void compare(fmi3Instance one, fmi3Instance two) {
    enum { MOST = 32 };
    const fmi3ValueReference outputs[] = {VR_apms, VR_objects};
    const fmi3ValueReference range = VR_blind_zone_range, sharer = VR_match_sharer;
    double ranges[2][MOST] = {{0}};
    int64_t ids[2][8] = {{0}};
    for (int k = 0; k < 2; k++) {
        fmi3Binary a, b;
        size_t n = output(one, outputs[k], &a), m = output(two, outputs[k], &b);
        differences += n != m || (n > 0 && memcmp(a, b, n) != 0);
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
    size_t size = output(from, VR_apms, &bytes);
    uint8_t *copy = malloc(size ? size : 1);
    if (size) memcpy(copy, bytes, size);
    set_binary(to, VR_received, copy, size);
    free(copy);
}

static void live_once(void) {
    fmi3Instance one = instantiate(), two = instantiate();
    if (one && two) {
        initialise(one, 8);
        initialise(two, 4);
        for (int k = 0; k < 4; k++) {
            set_points(one, k == 2 ? 1 : 0, k * 100000000LL);
            if (k == 3) set_map(one, ROAD, ROUTE);
            move_state(one, two);
            step(one, 0.1 * k);
            step(two, 0.1 * k);
            compare(one, two);
            receive(two, one);
        }
        note(fmi3Reset(two));
        note(fmi3Terminate(one));
    }
    fmi3FreeInstance(one);
    fmi3FreeInstance(two);
}

int main(int count, char **arguments) {
    countdown = -1;
    is_starved = count > 1 && strcmp(arguments[1], "starved") == 0;
    for (kind_of_index = 1; kind_of_index <= 2; kind_of_index++) {
        if (!is_starved) live_once();
        else if (starve(live_once)) return 1;
    }
    if (is_starved) return 0;
    printf("%zu zones, %zu sharers, %d failures, %d differences\n", zones, sharers, failures,
           differences);
    return failures != 0 || differences != 0;
}
