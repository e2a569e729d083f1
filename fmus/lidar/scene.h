/* What a sensor can see, in the world frame: upright prisms over a flat ground at z = 0. */
#ifndef SCENE_H
#define SCENE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    size_t count;
    const int64_t *id;
    const double *position; /* (count, 3), centre of the footprint [m] */
    const double *heading;  /* [rad] */
    const double *size;     /* (count, 3), length, width, height [m] */
    const int32_t *body;    /* class, see bodies.h */
    const bool *lidar;
} Vehicles;

typedef struct {
    size_t vertex_count, count;
    const double *vertex; /* (vertex_count, 2) [m] */
    const int32_t *index; /* building of each vertex, ascending */
    const double *height; /* (count) [m] */
} Buildings;

/* What a hit says about the thing that was hit. */
typedef struct {
    int32_t instance;
    double reflectivity; /* at normal incidence, 0..1 */
} Surface;
extern const Surface GROUND_SURFACE;

/* An owner for what is not part of a vehicle. */
#define NO_OWNER SIZE_MAX

typedef struct {
    size_t first, count;  /* its ring of corners in Scene.corner, counter-clockwise */
    double bottom, top;   /* [m] */
    double center[2], radius; /* of a circle around the ring [m] */
    Surface surface;
    size_t owner; /* index of the vehicle it is part of, or NO_OWNER */
} Prism;

typedef struct {
    double *corner; /* (corner_count, 2) [m] */
    size_t corner_count, corner_capacity;
    Prism *prism;
    size_t count, capacity;
} Scene;

/* Build the prisms of checked inputs (see check.h). An all-zero Scene is valid and empty. Returns
 * nonzero if memory is short. */
int scene_build(Scene *, const Vehicles *, const Buildings *);
void scene_clear(Scene *);

#endif
