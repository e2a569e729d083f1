/* The faces that one sensor may see: within its range and turned towards it, in its own frame
 * (origin at the sensor, tilted as it is). */
#ifndef VIEW_H
#define VIEW_H
#include <stddef.h>
#include <stdint.h>

#include "pattern.h"
#include "scene.h"

typedef struct {
    double position[3]; /* world frame [m] */
    double heading;     /* [rad] */
    size_t vehicle;     /* that carries it; its own body is not seen */
} Viewpoint;

typedef struct {
    double x, y, z;   /* sensor frame [m]; never on the z axis */
    uint32_t azimuth; /* at it or the next one clockwise of it */
} Corner;

/* A polygon in a plane. A ray whose direction in the sensor frame is a multiple of (x, y, slope),
 * with x^2 + y^2 = 1, meets the plane at the horizontal distance
 * 1 / (plane[0] x + plane[1] y + plane[2] slope). */
typedef struct {
    double plane[3]; /* inward normal / distance [1/m] */
    double distance; /* of the plane from the sensor [m] */
    Surface surface;
    uint32_t first, count; /* its corners in View.corner_of, counter-clockwise from outside */
    int convex;            /* known to be so */
} Face;

typedef struct {
    const Prism *prism;
    uint32_t first; /* in View.corner: the ring at the bottom, then the ring at the top */
} Seen;

/* Face 0 is the ground, which has no corners. Then come all walls, then all tops and bottoms; both
 * in the order of their prisms. */
typedef struct {
    Face *face;
    Corner *corner;
    uint32_t *corner_of; /* corners of the faces, one face after the other */
    Seen *seen;
    double *ring; /* room for one ring in the heading frame */
    size_t face_count, corner_count, corner_of_count, seen_count;
    size_t face_capacity, corner_capacity, corner_of_capacity, seen_capacity,
        ring_capacity;
} View;

/* Collect the faces seen from a viewpoint. An all-zero View is valid and empty. Returns nonzero if
 * memory is short. */
int view_build(View *, const Scene *, const Viewpoint *, const Pattern *);
void view_clear(View *);

#endif
