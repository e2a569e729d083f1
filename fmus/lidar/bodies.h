/* The shapes of vehicle bodies: a few boxes per class, scaled by the vehicle's size. */
#ifndef BODIES_H
#define BODIES_H
#include <stddef.h>
#include <stdint.h>

/* Values of `vehicle.body`. */
enum { BODY_CAR, BODY_SUV, BODY_VAN, BODY_BUS, BODY_TRUCK, BODY_CLASSES };
enum { BODY_PARTS_MAXIMUM = 3 };

/* One box, in fractions of the body's length (from its centre, forward positive), width (of the
 * whole, centred) and height (from the ground). */
typedef struct {
    double rear, front, width, bottom, top;
} BodyPart;

/* The parts of a class; `*count` is their number, 1..BODY_PARTS_MAXIMUM. */
const BodyPart *body_parts(int32_t body, size_t *count);

#endif
