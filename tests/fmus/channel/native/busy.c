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

static int differences;
static size_t receptions, transmissions; /* [byte] */

/* ---- inputs ---- */

enum { VEHICLES = 9, PACKETS = 12 };

static uint32_t any(uint32_t below) { /* a linear congruential generator */
    static uint32_t state;
    if (below == 0) return state = 1;
    state = state * 1664525u + 1013904223u;
    return (state >> 16) % below;
}

static void set_vehicles(fmi3Instance c, uint64_t first, uint64_t count) {
    const fmi3ValueReference id = VR_vehicle_id, equipped = VR_vehicle_equipped;
    note(fmi3EnterConfigurationMode(c));
    set_length(c, VR_n_vehicle, count);
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
    set_binary(c, VR_packets, &signal, sizeof signal);
}

/* ---- life ---- */

static void begin(fmi3Instance c, uint64_t vehicles, uint32_t threads) {
    const fmi3ValueReference fading = VR_fading, limit = VR_queue_limit, workers = VR_threads;
    const int64_t nakagami = 2;
    const uint32_t two = 2;
    note(fmi3SetInt64(c, &fading, 1, &nakagami, 1));
    note(fmi3SetUInt32(c, &limit, 1, &two, 1));
    note(fmi3SetUInt32(c, &workers, 1, &threads, 1));
    set_float(c, VR_packet_lifetime, 2e-3);
    note(fmi3EnterConfigurationMode(c));
    set_length(c, VR_n_building, 1);
    set_length(c, VR_n_building_vertex, 4);
    note(fmi3ExitConfigurationMode(c));
    set_vehicles(c, 0, vehicles);
    set_house(c);
    initialise(c);
}

static void live_together(fmi3Instance one, fmi3Instance two) {
    begin(one, VEHICLES, 3); /* and nobody can tell */
    begin(two, 2, 1);
    for (int k = 0; k < 6; k++) {
        double t = 1e-3 * k;
        if (k == 2) set_vehicles(one, 2, VEHICLES - 2);
        if (k == 4) set_vehicles(one, 0, VEHICLES - 3);
        set_packets(one, 1 + k * PACKETS, k * 1000000);
        move_state(one, two);
        step(one, t, 1e-3);
        step(two, t, 1e-3);
        differences += differ(one, two, VR_receptions, &receptions);
        differences += differ(one, two, VR_transmissions, &transmissions);
    }
    note(fmi3Reset(two));
    note(fmi3Terminate(one));
}

static void live_once(void) {
    any(0);
    live_as_two("channel", live_together);
}

int main(int count, char **arguments) {
    if (shall_starve(count, arguments)) return starve(live_once);
    live_once();
    printf("%zu bytes of receptions, %zu of transmissions, %d failures, %d differences\n", receptions,
           transmissions, atomic_load(&failures), differences);
    return failures != 0 || differences != 0;
}
