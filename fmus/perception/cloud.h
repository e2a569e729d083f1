/* Reading the scans of all sensors from a Binary signal ("LPTS"). */
#ifndef CLOUD_H
#define CLOUD_H
#include "records.h"
#include "kernel.h"

typedef struct {
    const uint8_t *sensors, *points; /* records at any address: copy them out */
    size_t sensor_count, point_count;
} Cloud;

/* Read and check the frame and all its sensors, not the points. No bytes are no sensors. */
int cloud_open(Cloud *, const uint8_t *bytes, size_t size, Problem *);
/* One of the sensors; `index` is below sensor_count. */
Sensor cloud_sensor(const Cloud *, size_t index);

#endif
