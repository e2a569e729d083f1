/* What all links between two areas have in common: how long they are at least, and what buildings take
 * from every one of them. */
#ifndef GAP_H
#define GAP_H
#include "pair.h"
#include "scene.h"

typedef struct {
    const Area *a, *b;
    double top;      /* no antenna is higher [m] */
    double shortest; /* no link is shorter, in the plane [m] */
    double loss;     /* of every link, at least; a factor */
} Gap;

/* The gap between two areas, nothing in it yet. */
Gap gap_between(const Area *a, const Area *b, double top);

/* Whether building k may be in the way of a link; what it takes from all of them is added to the
 * loss. */
bool gap_meets(Gap *, const Scene *, const Propagation *, uint32_t k);

#endif
