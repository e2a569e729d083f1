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

/* A box in the making, levelled frame of the sensor. */
typedef struct {
    double angle, axis[2];     /* of its first side [rad], as a unit vector */
    double low[2], high[2];    /* along that side, and across [m] */
} Turned;

/* Points of a cluster by which its angle is found. */
typedef struct {
    size_t first, count;
    uint32_t mask; /* bits that are 0 in the hash of a point in the sample */
} Sample;

typedef struct {
    Box *boxes; /* of each cluster of the last scan; undefined if it has too few points */
    /* kept for their memory */
    float *place[2]; /* of the points in the samples, levelled frame [m] */
    Sample *samples;
    Turned *turned;
    size_t box_capacity, place_capacity[2], sample_capacity, turned_capacity;
} Boxes;

/* Find the smallest boxes around all points of the clusters that have `minimum_points` or more. */
int boxes_find(Boxes *, BoxKind, const Sensor *, const Scan *, uint32_t minimum_points, Problem *);
void boxes_free(Boxes *);

#endif
