/* The boundary of a face as a sensor sees it: which of its edges the rays' planes cross, and where.
 *
 * All rays of one azimuth lie in a half-plane that ends at the sensor's z axis. It crosses the edge
 * from P to Q if its azimuth is between theirs, at the slope (vertical over horizontal) at which it
 * meets the plane through P, Q and the sensor:
 *
 *     slope = -(n_x x + n_y y) / n_z   with n = P x Q, (x, y) the horizontal direction.
 *
 * Two faces with a common edge calculate the same bits for it, so no ray slips between them. */
#ifndef OUTLINE_H
#define OUTLINE_H
#include <stdint.h>

#include "pattern.h"
#include "view.h"

/* Crosses `to - from` azimuths, or `from - to`, counted from those of the first corner: those above
 * the smaller number, up to the greater one. */
typedef struct {
    int64_t from, to;
    double slope[3]; /* at the horizontal direction (x, y): slope[0] x + slope[1] y + slope[2] */
} Edge;

typedef struct {
    const Edge *edge;
    uint32_t count;
    int64_t low, high; /* the smallest and the greatest `from` and `to` */
    uint32_t first;    /* number of the first azimuth that is crossed: `low` + 1 */
} Outline;

/* Follow the boundary of a face of `view`; `edge` has room for its corners. */
Outline outline_of(const View *view, const Face *face, const Pattern *, Edge *edge);

#endif
