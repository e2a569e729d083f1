/* Loss by vehicle bodies in the way: a knife edge over each roof. */
#ifndef VEHICLE_SHADOWING_H
#define VEHICLE_SHADOWING_H
#include "antenna.h"
#include "geometry.h"
#include "area_index.h"
#include "knife_edge.h"
#include <stdint.h>

typedef struct {
    Rectangle outline;
    double base, roof;    /* heights of the road under the body and of its roof [m] */
    double radius_square; /* of the circle around the outline, and a hair more [m2] */
} Body;

/* The edges under one direction of a link, ascending by distance from its transmitter; the first
 * point is the one antenna, and when all edges are in, the last is the other. */
typedef struct {
    double *distance, *height;
    uint32_t *owner; /* the body */
    double *v;       /* scratch, see Edges */
    size_t n;
    size_t distance_capacity, height_capacity, owner_capacity, v_capacity;
} EdgeRow;

typedef struct {
    size_t count;
    Body *body;
    Area *area;
    AreaIndex index;
    size_t body_capacity, area_capacity;
} Bodies;

/* What a query writes to: bodies near the link; edges in its two directions; rope. Each thread has its
 * own. */
typedef struct {
    uint32_t *near, *major;
    EdgeRow row[2];
    size_t near_capacity, major_capacity;
} BodyScratch;

/* How bodies are turned into knife edges, prepared for many links. */
typedef struct {
    EdgeScale scale;
    double wavelength; /* at the centre [m] */
    bool reciprocal;   /* edge in the middle of the body, else at its face nearest to the transmitter */
} EdgeModel;

/* Directions of a link, from a to b and back, as bits. */
enum { FORTH = 1, BACK = 2, BOTH = 3 };

/* Of the two directions of a link; valid until the next query with the same scratch. */
typedef struct {
    Edges edges[2];
    bool blocked[2]; /* a body rises above the straight line between the antennas */
} BodyShadow;

/* Make room for `count` bodies, to be filled in by `bodies_put`; nonzero if memory is short. */
int bodies_resize(Bodies *, size_t count);
/* Body k: centre of the footprint on the ground, direction [rad], length, width, height [m]. */
void bodies_put(Bodies *, size_t k, Position center, double heading, const double size[3]);
/* To be called when all bodies are in; nonzero if memory is short. */
int bodies_index(Bodies *);
void bodies_free(Bodies *);

/* Make room for queries among these bodies; nonzero if memory is short. */
int body_scratch_reserve(BodyScratch *, const Bodies *);
void body_scratch_free(BodyScratch *);

#define NO_BODY SIZE_MAX

EdgeModel edge_model(const Parameters *);

/* All bodies whose areas the link from a to b comes nearer to than `margin` in x and y; valid until
 * the next query with the same scratch. */
Nearby bodies_near(const Bodies *, BodyScratch *, Position a, Position b, const double margin[2]);

/* Shadows on the link between a and b in the directions `ways`; in a reciprocal model they are equal,
 * and it is that of the first that counts. The bodies that carry the antennas never shadow. The
 * result does not depend on the order of the nearby bodies, nor on bodies among them that are not in
 * the way. */
BodyShadow bodies_shadow(const Bodies *, BodyScratch *, const Antenna *a, const Antenna *b, Nearby,
                         const EdgeModel *, unsigned ways);

#endif
