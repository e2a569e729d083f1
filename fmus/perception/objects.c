#include "objects.h"

#include <stdlib.h>

static Object object_of(const Cluster *cluster, const Track *track, const Sensor *sensor) {
    const Box box = box_of(cluster);
    double velocity[2];
    to_world(track->axis, track->velocity, velocity);
    return (Object){
        .sensor = sensor->vehicle,
        .time = sensor->time,
        .instance = track->number,
        .points = cluster->points,
        .position = {box.position[0], box.position[1]},
        .angle = box.angle,
        .size = {box.size[0], box.size[1]},
        .height = cluster->height,
        .velocity = {velocity[0], velocity[1]},
    };
}

static int by_instance(const void *a, const void *b) {
    int64_t left = ((const Object *)a)->instance, right = ((const Object *)b)->instance;
    return (left > right) - (left < right);
}

/* Index of the object with this track number; it exists. */
static uint32_t place_of(const Objects *objects, int64_t number) {
    size_t low = 0, high = objects->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (objects->objects[middle].instance < number) low = middle + 1;
        else high = middle;
    }
    return (uint32_t)low;
}

/* Let clusters have the boxes that fit; their directions are known from the tracks as long as they do. */
static int fit_boxes(Objects *objects, const Tracks *tracks, const ObjectSettings *settings,
                     const Sensor *sensor, Scan *scan, Problem *problem) {
    Boxes *boxes = &objects->boxes;
    if (reserve(&objects->former_axes, &objects->former_capacity, scan->cluster_count,
                sizeof(double *), problem)
        || boxes_fit(boxes, scan, settings->minimum_points, problem))
        return 1;
    for (size_t i = 0; i < scan->cluster_count; i++) {
        const Track *track;
        if (settings->has_labels)
            track = tracks_find(tracks, sensor->vehicle, scan->clusters[i].label);
        else {
            double place[2];
            boxes_middle(boxes, scan, i, place);
            track = tracks_near(tracks, sensor, place, settings->track.gate);
        }
        objects->former_axes[i] = track ? track->axis : NULL;
    }
    return boxes_turn(boxes, scan, objects->former_axes, problem);
}

int objects_detect(Objects *objects, Tracks *tracks, const ObjectSettings *settings,
                   const Sensor *sensor, Scan *scan, Problem *problem) {
    size_t clusters = scan->cluster_count;
    objects->count = 0;
    if (reserve(&objects->objects, &objects->capacity, clusters, sizeof(Object), problem)
        || reserve(&objects->of_cluster, &objects->cluster_capacity, clusters, sizeof(uint32_t),
                   problem))
        return 1;
    if ((settings->boxes == FITTED && fit_boxes(objects, tracks, settings, sensor, scan, problem))
        || tracks_update(tracks, &settings->track, sensor, scan, settings->has_labels,
                         settings->minimum_points, problem))
        return 1;
    for (size_t i = 0; i < clusters; i++) {
        const Detection *detection = &tracks->detections[i];
        if (!detection->is_object) continue;
        const Track *track = tracks_find(tracks, sensor->vehicle, detection->number);
        objects->objects[objects->count++] = object_of(&scan->clusters[i], track, sensor);
    }
    if (objects->count > 1)
        qsort(objects->objects, objects->count, sizeof(Object), by_instance);
    for (size_t i = 0; i < clusters; i++)
        objects->of_cluster[i] = tracks->detections[i].is_object
                                     ? place_of(objects, tracks->detections[i].number)
                                     : NO_OBJECT;
    return 0;
}

void objects_free(Objects *objects) {
    free(objects->objects);
    free(objects->of_cluster);
    free(objects->former_axes);
    boxes_free(&objects->boxes);
}
