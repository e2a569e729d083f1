#include "tilt.h"

#include "portable_math.h"

Tilt tilt_of(const Sensor *sensor) {
    double sp, cp, sr, cr;
    sine_cosine(sensor->pitch, &sp, &cp);
    sine_cosine(sensor->roll, &sr, &cr);
    return (Tilt){
        .forward = {cp, sp * sr, sp * cr},
        .left = {0.0, cr, -sr},
        .up = {-sp, cp * sr, cp * cr},
    };
}

void tilt_apply(const Tilt *tilt, const double vector[3], double levelled[3]) {
    const double *row[3] = {tilt->forward, tilt->left, tilt->up};
    for (int i = 0; i < 3; i++)
        levelled[i] = row[i][0] * vector[0] + row[i][1] * vector[1] + row[i][2] * vector[2];
}
