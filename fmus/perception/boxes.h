/* The boxes of clusters: turned as the faces of the bodies are, or along the world's axes. */
#ifndef BOXES_H
#define BOXES_H
#include "scan.h"

/* Values of the parameter `boxes`. */
typedef enum { FITTED = 1, ALONG_AXES } BoxKind;

/* A rectangle in the plane, world frame. */
typedef struct {
    double position[2]; /* its middle [m] */
    double angle;       /* of its first side, counter-clockwise from east, 0 to below PI / 2 [rad] */
    double size[2];     /* along that side, and across [m] */
} Box;

/* The points by which the angle of a cluster is found. */
typedef struct {
    size_t first, count;
    uint32_t mask; /* of the hash of points that are taken */
} Sample;

/* How far they reach, along an axis and across [m]. */
typedef struct {
    float low[2], high[2];
} Extent;

/* A direction of the first side of a box, in the first quarter of the levelled frame. */
typedef struct {
    uint32_t angle;  /* counted */
    double axis[2];  /* unit vector */
    uint64_t misfit; /* of the sample */
    Extent extent;
} Orientation;

/* The directions of the boxes of one scan; kept for their memory. */
typedef struct {
    float *place[2]; /* of the points in the samples, levelled frame [m] */
    Sample *samples; /* for each cluster, as all that follows */
    Orientation *best;
    double (*axes)[2]; /* of first sides, as in an Orientation */
    size_t place_capacity[2], sample_capacity, best_capacity, axis_capacity;
} Boxes;

/* Find the directions that fit clusters of `minimum_points` or more best. */
int boxes_fit(Boxes *, const Scan *, uint32_t minimum_points, Problem *);
/* About where the middle of a cluster is, world frame [m]; after boxes_fit. */
void boxes_middle(const Boxes *, const Scan *, size_t cluster, double place[2]);
/* Let the sides of clusters be along the directions that fit, after boxes_fit. `former_axes` are for each
 * cluster a direction that a side of it had before, as a unit vector in the world, or NULL; it is kept as
 * long as it fits nearly as well. */
int boxes_turn(Boxes *, Scan *, const double *const *former_axes, Problem *);
/* The smallest box around all points of a cluster along its axes. */
Box box_of(const Cluster *);
void boxes_free(Boxes *);

#endif
