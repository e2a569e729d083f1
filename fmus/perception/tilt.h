/* From the frame of a sensor to its levelled frame: x along the heading, z up, same origin. */
#ifndef TILT_H
#define TILT_H
#include "records.h"

/* The rows of a rotation. */
typedef struct {
    double forward[3], left[3], up[3];
} Tilt;

/* Turn about x by the sensor's roll, then about y by its pitch. */
Tilt tilt_of(const Sensor *);
/* `levelled` = tilt `vector`. */
void tilt_apply(const Tilt *, const double vector[3], double levelled[3]);

#endif
