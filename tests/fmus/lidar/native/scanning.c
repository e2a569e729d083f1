/* A short life of the lidar: sensors that come and go among houses, tilted. Linked with the sources
 * of the unit and of the shell.
 *
 *     scanning          lives once
 *     scanning starved  lives again and again, each time with the next allocation failing
 *
 * Nothing may crash, nothing may leak; with enough memory everything must succeed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "starving.h"
#include "variables.h"

enum { VEHICLES = 6, CORNERS = 7 };

static size_t bytes;

static void set_lengths(fmi3Instance c, uint64_t vehicles, uint64_t houses, uint64_t corners) {
    note(fmi3EnterConfigurationMode(c));
    set_length(c, VR_n_vehicle, vehicles);
    set_length(c, VR_n_building, houses);
    set_length(c, VR_n_building_vertex, corners);
    note(fmi3ExitConfigurationMode(c));
}

static void set_vehicles(fmi3Instance c, size_t count) {
    const fmi3ValueReference id = VR_vehicle_id, body = VR_vehicle_body, lidar = VR_vehicle_lidar;
    int64_t ids[VEHICLES];
    int32_t bodies[VEHICLES];
    bool lidars[VEHICLES];
    double position[VEHICLES][3], heading[VEHICLES], size[VEHICLES][3];
    for (size_t k = 0; k < count; k++) {
        ids[k] = (int64_t)(10 * k);
        bodies[k] = (int32_t)(k % 5);
        lidars[k] = k % 2 == 0;
        position[k][0] = 8.0 * (double)k, position[k][1] = 3.0 * (double)(k % 3);
        position[k][2] = k == 3 ? 4.0 : 0.0;
        heading[k] = (double)k;
        size[k][0] = 5, size[k][1] = 2, size[k][2] = 1.5 + 0.4 * (double)k;
    }
    note(fmi3SetInt64(c, &id, 1, ids, count));
    note(fmi3SetInt32(c, &body, 1, bodies, count));
    note(fmi3SetBoolean(c, &lidar, 1, lidars, count));
    set_floats(c, VR_vehicle_position, &position[0][0], 3 * count);
    set_floats(c, VR_vehicle_heading, heading, count);
    set_floats(c, VR_vehicle_size, &size[0][0], 3 * count);
}

static void set_houses(fmi3Instance c) { /* a triangle, and a square with a corner pushed in */
    const fmi3ValueReference index = VR_building_index;
    const double corners[CORNERS][2] = {{20, 20}, {40, 20}, {30, 30}, {-9, -9}, {-3, -9}, {-6, -6},
                                        {-9, -3}};
    const double heights[2] = {1.0, 9.0};
    const int32_t owner[CORNERS] = {0, 0, 0, 1, 1, 1, 1};
    set_floats(c, VR_building_vertex, &corners[0][0], 2 * CORNERS);
    set_floats(c, VR_building_height, heights, 2);
    note(fmi3SetInt32(c, &index, 1, owner, CORNERS));
}

static void begin(fmi3Instance c) {
    const fmi3ValueReference azimuths = VR_azimuths;
    const int32_t few = 16;
    note(fmi3SetInt32(c, &azimuths, 1, &few, 1));
    set_float(c, VR_pitch, 0.2);
    set_float(c, VR_elevation_bottom, -1.4);
    set_lengths(c, 1, 0, 0);
    set_vehicles(c, 1);
    initialise(c);
}

static void scan(fmi3Instance c, double t) {
    fmi3Binary data;
    step(c, t, 0.1);
    size_t size = get_binary(c, VR_points, &data);
    for (size_t i = 0; i < size; i++)
        bytes += data[i] != 0; /* reads all of it */
}

static void live_once(void) {
    fmi3Instance c = instantiate("lidar");
    if (c) {
        begin(c);
        scan(c, 0.0);
        set_lengths(c, VEHICLES, 2, CORNERS);
        set_vehicles(c, VEHICLES);
        set_houses(c);
        scan(c, 0.1);
        set_lengths(c, 2, 2, CORNERS);
        set_vehicles(c, 2);
        scan(c, 0.2);
        note(fmi3Terminate(c));
    }
    fmi3FreeInstance(c);
}

int main(int count, char **arguments) {
    if (shall_starve(count, arguments)) return starve(live_once);
    live_once();
    printf("%zu bytes of points, %d failures\n", bytes, atomic_load(&failures));
    return failures != 0;
}
