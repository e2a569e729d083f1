/* The shapes of road users: a few boxes per value of `vehicle.body`, scaled by `vehicle.size`. */
#ifndef BODIES_H
#define BODIES_H
#include <stddef.h>
#include <stdint.h>

enum { BODY_PARTS_MAXIMUM = 4 };

/* One box, in fractions of the body's length (from its centre, forward positive), width (of the
 * whole, centred) and height (from the ground). */
typedef struct {
    double rear, front, width, bottom, top;
} BodyPart;

/* The parts of a class, BODY_CAR ... as in records.h; `*count` is their number, 1..BODY_PARTS_MAXIMUM. */
const BodyPart *body_parts(int32_t body, size_t *count);

#endif
