#include "scene.h"

#include <math.h>
#include <string.h>

#include "bodies.h"
#include "memory.h"
#include "portable_math.h"
#include "records.h"

/* Representative reflectivities in the near infrared; docs/physics-lidar.md discusses them. */
static const double GROUND_REFLECTIVITY = 0.2, BUILDING_REFLECTIVITY = 0.4,
                    VEHICLE_REFLECTIVITY = 0.5;

const Surface GROUND_SURFACE = {GROUND, GROUND_REFLECTIVITY};

/* A circle around the corners: centre of the bounding box, distance of the farthest corner. */
static void bound(Prism *prism, const double *corner) {
    double low[2] = {corner[0], corner[1]}, high[2] = {corner[0], corner[1]};
    for (size_t i = 1; i < prism->count; i++)
        for (size_t axis = 0; axis < 2; axis++) {
            low[axis] = fmin(low[axis], corner[2 * i + axis]);
            high[axis] = fmax(high[axis], corner[2 * i + axis]);
        }
    double square = 0.0;
    for (size_t axis = 0; axis < 2; axis++)
        prism->center[axis] = 0.5 * (low[axis] + high[axis]);
    for (size_t i = 0; i < prism->count; i++) {
        double x = corner[2 * i] - prism->center[0], y = corner[2 * i + 1] - prism->center[1];
        square = fmax(square, x * x + y * y);
    }
    prism->radius = sqrt(square);
}

static void add_box(Scene *scene, const Vehicles *vehicles, size_t v, const BodyPart *part) {
    static const int AHEAD[4] = {0, 1, 1, 0}, LEFT[4] = {0, 0, 1, 1}; /* counter-clockwise */
    const double *position = vehicles->position + 3 * v, *size = vehicles->size + 3 * v;
    Prism *prism = &scene->prism[scene->count++];
    *prism = (Prism){
        .first = scene->corner_count,
        .count = 4,
        .bottom = position[2] + part->bottom * size[2],
        .top = position[2] + part->top * size[2],
        .surface = {(int32_t)vehicles->id[v], VEHICLE_REFLECTIVITY},
        .owner = v,
    };
    double sine, cosine;
    sine_cosine(vehicles->heading[v], &sine, &cosine);
    for (int i = 0; i < 4; i++) {
        double x = size[0] * (AHEAD[i] ? part->front : part->rear);
        double y = size[1] * part->width * (LEFT[i] ? 0.5 : -0.5);
        double *corner = scene->corner + 2 * scene->corner_count++;
        corner[0] = position[0] + cosine * x - sine * y;
        corner[1] = position[1] + sine * x + cosine * y;
    }
    bound(prism, scene->corner + 2 * prism->first);
}

/* Twice the signed area, about the first corner so that large coordinates do not cancel. */
static double signed_area(const double *ring, size_t count) {
    double area = 0.0;
    for (size_t i = 1; i + 1 < count; i++) {
        const double *a = ring + 2 * i, *b = a + 2;
        area += (a[0] - ring[0]) * (b[1] - ring[1]) - (a[1] - ring[1]) * (b[0] - ring[0]);
    }
    return area;
}

static void add_building(Scene *scene, const Buildings *buildings, size_t first, size_t count) {
    int32_t index = buildings->index[first];
    const double *ring = buildings->vertex + 2 * first;
    int clockwise = signed_area(ring, count) < 0.0;
    Prism *prism = &scene->prism[scene->count++];
    *prism = (Prism){
        .first = scene->corner_count,
        .count = count,
        .top = buildings->height[index],
        .surface = {BUILDING - index, BUILDING_REFLECTIVITY},
        .owner = NO_OWNER,
    };
    for (size_t i = 0; i < count; i++) {
        size_t j = clockwise ? count - 1 - i : i;
        memcpy(scene->corner + 2 * scene->corner_count++, ring + 2 * j, 2 * sizeof *ring);
    }
    bound(prism, scene->corner + 2 * prism->first);
}

int scene_build(Scene *scene, const Vehicles *vehicles, const Buildings *buildings) {
    int short_of_memory = 0;
    size_t boxes = BODY_PARTS_MAXIMUM * vehicles->count;
    scene->prism = with_room(scene->prism, &scene->capacity, boxes + buildings->count,
                             sizeof *scene->prism, &short_of_memory);
    scene->corner = with_room(scene->corner, &scene->corner_capacity,
                              4 * boxes + buildings->vertex_count, 2 * sizeof *scene->corner,
                              &short_of_memory);
    if (short_of_memory)
        return 1;
    scene->count = scene->corner_count = 0;
    for (size_t first = 0, end; first < buildings->vertex_count; first = end) {
        for (end = first + 1; end < buildings->vertex_count; end++)
            if (buildings->index[end] != buildings->index[first])
                break;
        add_building(scene, buildings, first, end - first);
    }
    for (size_t v = 0; v < vehicles->count; v++) {
        size_t parts;
        const BodyPart *part = body_parts(vehicles->body[v], &parts);
        for (size_t i = 0; i < parts; i++)
            add_box(scene, vehicles, v, part + i);
    }
    return 0;
}

void scene_clear(Scene *scene) {
    free(scene->corner);
    free(scene->prism);
    memset(scene, 0, sizeof *scene);
}
