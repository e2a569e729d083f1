#include "objects.h"

#include <stdlib.h>

static Object object_of(const Cluster *cluster, const Track *track, const Sensor *sensor) {
    return (Object){
        .sensor = sensor->vehicle,
        .time = sensor->time,
        .instance = cluster->instance,
        .points = cluster->points,
        .minimum = {cluster->side[X_MINIMUM], cluster->side[Y_MINIMUM]},
        .maximum = {cluster->side[X_MAXIMUM], cluster->side[Y_MAXIMUM]},
        .height = cluster->height,
        .velocity = {track->velocity[0], track->velocity[1]},
    };
}

static int by_instance(const void *a, const void *b) {
    int64_t left = ((const Object *)a)->instance, right = ((const Object *)b)->instance;
    return (left > right) - (left < right);
}

static int is_object(const Cluster *cluster, const ObjectSettings *settings) {
    return cluster->instance >= 0 && cluster->points >= settings->minimum_points;
}

/* Index of the object with this instance; it exists. */
static uint32_t place_of(const Objects *objects, int64_t instance) {
    size_t low = 0, high = objects->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (objects->objects[middle].instance < instance) low = middle + 1;
        else high = middle;
    }
    return (uint32_t)low;
}

int objects_detect(Objects *objects, Tracks *tracks, const ObjectSettings *settings,
                   const Sensor *sensor, const Scan *scan, Problem *problem) {
    objects->count = 0;
    size_t clusters = scan->cluster_count;
    if (clusters == 0) return 0;
    if (reserve(&objects->objects, &objects->capacity, clusters, sizeof(Object), problem)
        || reserve(&objects->of_cluster, &objects->cluster_capacity, clusters, sizeof(uint32_t),
                   problem))
        return 1;
    for (size_t i = 0; i < clusters; i++) {
        if (!is_object(&scan->clusters[i], settings)) continue;
        size_t track;
        if (tracks_update(tracks, &settings->track, sensor->vehicle, sensor->time, scan, i, &track,
                          problem))
            return 1;
        objects->objects[objects->count++] =
            object_of(&scan->clusters[i], &tracks->tracks[track], sensor);
    }
    qsort(objects->objects, objects->count, sizeof(Object), by_instance);
    for (size_t i = 0; i < clusters; i++)
        objects->of_cluster[i] = is_object(&scan->clusters[i], settings)
                                     ? place_of(objects, scan->clusters[i].instance)
                                     : NO_OBJECT;
    return 0;
}

void objects_free(Objects *objects) {
    free(objects->objects);
    free(objects->of_cluster);
}
