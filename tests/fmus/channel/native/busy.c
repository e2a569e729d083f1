/* A short busy life of the channel: queues, noise, relays, states that go to another instance, vehicles
 * that come and go. Linked with the sources of the unit and of the shell.
 *
 *     busy          lives once
 *     busy starved  lives again and again, each time with the next allocation failing
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
static size_t receptions, transmissions;
static void on_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                       fmi3String message) {
    (void)environment, (void)category;
    if (status >= fmi3Error && messages++ == 0 && !is_starved) printf("%s\n", message);
}

/* ---- inputs ---- */

enum { VEHICLES = 9, PACKETS = 12 };

static uint32_t any(uint32_t below) { /* a linear congruential generator */
    static uint32_t state;
    if (below == 0) return state = 1;
    state = state * 1664525u + 1013904223u;
    return (state >> 16) % below;
}

static void set_floats(fmi3Instance c, fmi3ValueReference vr, const double *x, size_t n) {
    note(fmi3SetFloat64(c, &vr, 1, x, n));
}

static void set_vehicles(fmi3Instance c, uint64_t first, uint64_t count) {
    const fmi3ValueReference n = VR_n_vehicle, id = VR_vehicle_id, equipped = VR_vehicle_equipped;
    note(fmi3EnterConfigurationMode(c));
    note(fmi3SetUInt64(c, &n, 1, &count, 1));
    note(fmi3ExitConfigurationMode(c));
    int64_t ids[VEHICLES];
    bool radios[VEHICLES];
    double position[VEHICLES][3], heading[VEHICLES], size[VEHICLES][3], height[VEHICLES];
    for (uint64_t k = 0; k < count; k++) {
        uint64_t vehicle = first + k;
        ids[k] = (int64_t)vehicle;
        radios[k] = vehicle % 7 != 6;
        position[k][0] = 90.0 * (double)(vehicle % 4), position[k][1] = 70.0 * (double)(vehicle / 4);
        position[k][2] = 0;
        heading[k] = (double)vehicle;
        size[k][0] = 5, size[k][1] = 2, size[k][2] = 1.5 + 0.2 * (double)vehicle;
        height[k] = 1.5 + 0.1 * (double)vehicle;
    }
    note(fmi3SetInt64(c, &id, 1, ids, count));
    note(fmi3SetBoolean(c, &equipped, 1, radios, count));
    set_floats(c, VR_vehicle_position, &position[0][0], 3 * count);
    set_floats(c, VR_vehicle_heading, heading, count);
    set_floats(c, VR_vehicle_size, &size[0][0], 3 * count);
    set_floats(c, VR_vehicle_antenna_height, height, count);
}

static void set_house(fmi3Instance c) {
    const fmi3ValueReference index = VR_building_index;
    const double corners[4][2] = {{20, 20}, {60, 20}, {60, 50}, {20, 50}}, height = 4;
    const int32_t owner[4] = {0};
    set_floats(c, VR_building_vertex, &corners[0][0], 8);
    set_floats(c, VR_building_height, &height, 1);
    note(fmi3SetInt32(c, &index, 1, owner, 4));
}

static void set_packets(fmi3Instance c, int64_t number, int64_t time) {
    struct { Frame head; Packet item[PACKETS]; } signal = {
        {{'P', 'K', 'T', 'S'}, 1, PACKETS, sizeof(Packet)}, {{0}}};
    for (int k = 0; k < PACKETS; k++) {
        Packet *p = &signal.item[k];
        int64_t source = any(6); /* 6 has no radio */
        bool is_noise = any(6) == 0;
        *p = (Packet){
            .id = number + k,
            .time = time + k * 60000,
            .source = source,
            .destination = is_noise ? NO_VEHICLE : (source + 2) % 6,
            .route = {is_noise || any(2) ? NO_VEHICLE : (source + 1) % 6, NO_VEHICLE},
            .duration = is_noise ? 500000 : 0,
            .power_offset = any(10),
            .size = 10 + any(300),
            .access_category = (uint8_t)any(4),
            .kind = is_noise ? NOISE : BSM,
        };
    }
    const fmi3ValueReference packets = VR_packets;
    const fmi3Binary bytes = (const uint8_t *)&signal;
    const size_t size = sizeof signal;
    note(fmi3SetBinary(c, &packets, 1, &size, &bytes, 1));
}

/* ---- life ---- */

static fmi3Instance instantiate(void) {
    fmi3Instance c = fmi3InstantiateCoSimulation("channel", INSTANTIATION_TOKEN, NULL, false, true,
                                                 false, false, NULL, 0, NULL, on_message, NULL);
    failures += c == NULL;
    return c;
}

static void initialise(fmi3Instance c, uint64_t vehicles) {
    const fmi3ValueReference fading = VR_fading, limit = VR_queue_limit, lifetime = VR_packet_lifetime;
    const fmi3ValueReference houses = VR_n_building, corners = VR_n_building_vertex;
    const int64_t nakagami = 2;
    const uint32_t two = 2;
    const double age = 2e-3;
    const uint64_t one = 1, four = 4;
    note(fmi3SetInt64(c, &fading, 1, &nakagami, 1));
    note(fmi3SetUInt32(c, &limit, 1, &two, 1));
    note(fmi3SetFloat64(c, &lifetime, 1, &age, 1));
    note(fmi3EnterConfigurationMode(c));
    note(fmi3SetUInt64(c, &houses, 1, &one, 1));
    note(fmi3SetUInt64(c, &corners, 1, &four, 1));
    note(fmi3ExitConfigurationMode(c));
    set_vehicles(c, 0, vehicles);
    set_house(c);
    note(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
    note(fmi3ExitInitializationMode(c));
}

static void step(fmi3Instance c, double t) {
    bool event, terminate, early;
    double last;
    note(fmi3DoStep(c, t, 1e-3, true, &event, &terminate, &early, &last));
}

static size_t output(fmi3Instance c, fmi3ValueReference vr, fmi3Binary *bytes) {
    size_t size = 0;
    *bytes = NULL;
    note(fmi3GetBinary(c, &vr, 1, &size, bytes, 1));
    return size;
}

static void compare(fmi3Instance one, fmi3Instance two) {
    const fmi3ValueReference outputs[] = {VR_receptions, VR_transmissions};
    size_t *counts[] = {&receptions, &transmissions};
    for (int k = 0; k < 2; k++) {
        fmi3Binary a, b;
        size_t n = output(one, outputs[k], &a), m = output(two, outputs[k], &b);
        differences += n != m || (n > 0 && memcmp(a, b, n) != 0);
        *counts[k] += n;
    }
}

static void live_once(void) {
    any(0);
    fmi3Instance one = instantiate(), two = instantiate();
    if (one && two) {
        initialise(one, VEHICLES);
        initialise(two, 2);
        for (int k = 0; k < 6; k++) {
            double t = 1e-3 * k;
            if (k == 2) set_vehicles(one, 2, VEHICLES - 2);
            if (k == 4) set_vehicles(one, 0, VEHICLES - 3);
            set_packets(one, 1 + k * PACKETS, k * 1000000);
            move_state(one, two);
            step(one, t);
            step(two, t);
            compare(one, two);
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
    if (is_starved) return starve(live_once);
    live_once();
    printf("%zu bytes of receptions, %zu of transmissions, %d failures, %d differences\n", receptions,
           transmissions, failures, differences);
    return failures != 0 || differences != 0;
}
