#include "pose_error.h"

#include "random_normal.h"

#include <math.h>
#include <string.h>

/* After so many correlation times what is left of an error is below the resolution of a double. */
static const double MEMORY = 40.0;

/* Draws from the standard normal distribution. The counter runs down from the key, where that of
 * the rays of a lidar with the same seed runs up. */
static void draw(double normal[POSE_ERRORS], int64_t seed, int64_t vehicle, int64_t time) {
    uint64_t key = mixed_bits((uint64_t)seed + RANDOM_STRIDE);
    key = mixed_bits((key ^ (uint64_t)time) + RANDOM_STRIDE);
    key = mixed_bits((key ^ (uint64_t)vehicle) + RANDOM_STRIDE);
    for (uint64_t i = 0; i < POSE_ERRORS; i++)
        normal[i] = standard_normal((uint32_t)(mixed_bits(key - (i + 1) * RANDOM_STRIDE) >> 32));
}

/* The entry of a vehicle, made with time -1 if there is none; NULL if memory is short. */
static PoseError *entry_of(PoseErrors *errors, int64_t vehicle, Problem *problem) {
    size_t i = 0;
    while (i < errors->count && errors->vehicles[i].vehicle < vehicle) i++;
    if (i < errors->count && errors->vehicles[i].vehicle == vehicle) return &errors->vehicles[i];
    if (reserve(&errors->vehicles, &errors->capacity, errors->count + 1, sizeof(PoseError),
                problem))
        return NULL;
    memmove(&errors->vehicles[i + 1], &errors->vehicles[i],
            (errors->count++ - i) * sizeof(PoseError));
    errors->vehicles[i] = (PoseError){.vehicle = vehicle, .time = -1};
    return &errors->vehicles[i];
}

/* The exact discretisation of de = -e dt / tau + sqrt(2 / tau) dW, whose variance is 1:
 * e(t + dt) = phi e(t) + sqrt(1 - phi^2) w with phi = exp(-dt / tau). (A. Gelb, Applied Optimal
 * Estimation, 1974, section 2.2) */
static int advance(PoseError *entry, const PoseErrorSettings *settings, int64_t time,
                   Problem *problem) {
    double fresh[POSE_ERRORS], phi = 0.0;
    if (time < entry->time)
        return fail(problem, "points: the scan of vehicle %lld at %lld ns is older than its last",
                    (long long)entry->vehicle, (long long)time);
    double elapsed = (double)(time - entry->time) * 1e-9 / settings->time;
    if (entry->time >= 0 && elapsed <= MEMORY) phi = exponential(-elapsed);
    draw(fresh, settings->seed, entry->vehicle, time);
    for (int i = 0; i < POSE_ERRORS; i++)
        entry->error[i] = phi * entry->error[i] + sqrt((1.0 - phi) * (1.0 + phi)) * fresh[i];
    entry->time = time;
    return 0;
}

int pose_believe(PoseErrors *errors, const PoseErrorSettings *settings, Sensor *sensor,
                 Problem *problem) {
    if (!(settings->position > 0.0 || settings->heading > 0.0)) return 0;
    double error[POSE_ERRORS];
    if (settings->time > 0.0) {
        PoseError *entry = entry_of(errors, sensor->vehicle, problem);
        if (!entry || advance(entry, settings, sensor->time, problem)) return 1;
        memcpy(error, entry->error, sizeof error);
    } else draw(error, settings->seed, sensor->vehicle, sensor->time);
    sensor->position[0] += settings->position * error[0];
    sensor->position[1] += settings->position * error[1];
    double heading = sensor->heading + settings->heading * error[2];
    sensor->heading = fmin(fmax(heading, -ANGLE_LIMIT), ANGLE_LIMIT);
    return 0;
}

void pose_forget(PoseErrors *errors, const PoseErrorSettings *settings, int64_t now) {
    size_t kept = 0;
    for (size_t i = 0; i < errors->count; i++)
        if ((double)(now - errors->vehicles[i].time) * 1e-9 <= MEMORY * settings->time)
            errors->vehicles[kept++] = errors->vehicles[i];
    errors->count = kept;
}
