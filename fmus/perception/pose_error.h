/* Each vehicle's own belief of its pose (satellite navigation) is off: stationary Gauss-Markov
 * errors of first order, by random numbers that depend on seed, vehicle and time only. */
#ifndef POSE_ERROR_H
#define POSE_ERROR_H
#include "cloud.h"

typedef struct {
    double position; /* standard deviation of each coordinate [m] */
    double heading;  /* [rad] */
    double time;     /* correlation time [s]; 0: errors of different scans are independent */
    int64_t seed;
} PoseErrorSettings;

enum { POSE_ERRORS = 3 }; /* of x, y and heading */

/* The errors of a vehicle at its last scan, in standard deviations. */
typedef struct {
    int64_t vehicle, time;
    double error[POSE_ERRORS];
} PoseError;

typedef struct {
    PoseError *vehicles; /* ascending */
    size_t count, capacity;
} PoseErrors;

/* Replace the sensor's true pose by what its vehicle believes. */
int pose_believe(PoseErrors *, const PoseErrorSettings *, Sensor *, Problem *);
/* Forget vehicles that have not been seen for so long that their errors are independent now. */
void pose_forget(PoseErrors *, const PoseErrorSettings *, int64_t now);

#endif
