/* Loss by vehicle bodies in the way: a knife edge over each roof. */
#ifndef VEHICLE_SHADOWING_H
#define VEHICLE_SHADOWING_H
#include "geometry.h"
#include "grid.h"
#include <stdint.h>

typedef struct {
    size_t count;
    Rectangle *body;
    double *base, *roof; /* heights of the road under the body and of its roof [m] */
    Box *box;
    Grid grid;
    /* scratch of one query: bodies near the link; the profile; the points the rope touches */
    uint32_t *near, *owner, *major;
    double *distance, *height;
    size_t body_capacity, base_capacity, roof_capacity, box_capacity, near_capacity, owner_capacity,
        major_capacity, distance_capacity, height_capacity;
} Bodies;

/* How bodies are turned into knife edges. */
typedef struct {
    double wavelength; /* [m] */
    double factor;     /* see knife_edges_db */
    bool reciprocal;   /* edge in the middle of the body, else at its face nearest to a */
} EdgeModel;

typedef struct {
    double loss_db;
    bool blocked; /* a body rises above the straight line between the antennas */
} BodyShadow;

/* Make room for `count` bodies, to be filled in by `bodies_put`; nonzero if memory is short. */
int bodies_resize(Bodies *, size_t count);
/* Body k: centre of the footprint on the ground, direction [rad], length, width, height [m]. */
void bodies_put(Bodies *, size_t k, Position center, double heading, const double size[3]);
/* To be called when all bodies are in; nonzero if memory is short. */
int bodies_index(Bodies *);
void bodies_free(Bodies *);

#define NO_BODY SIZE_MAX

/* Shadow on the link from a to b. The bodies that carry the antennas, `own_a` and `own_b` (or
 * NO_BODY), never shadow. */
BodyShadow bodies_shadow(Bodies *, Position a, Position b, size_t own_a, size_t own_b, EdgeModel);

#endif
