/* The channel's formulas as functions on arrays, for tests against golden data. Compiled together
 * with the sources of the FMU itself. Links are rows of `a` and `b`: x, y, z [m]. */
#include "building_shadowing.h"
#include "error_rate.h"
#include "knife_edge.h"
#include "path_loss.h"
#include "random.h"
#include "vehicle_shadowing.h"
#include <math.h>
#include <stdlib.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

static Position position(const double *row) { return (Position){row[0], row[1], row[2]}; }

EXPORT void path_losses(size_t n, const double *a, const double *b, const double *wavelength,
                        const double *exponent, double lossless_distance, double *loss) {
    for (size_t i = 0; i < n; i++)
        loss[i] = path_loss_db(distance_between(position(a + 3 * i), position(b + 3 * i)),
                               wavelength[i], exponent[i], lossless_distance);
}

EXPORT int penetrations(size_t corners, const double *corner, const int32_t *index, size_t count,
                        const double *height, bool finite, size_t n, const double *a,
                        const double *b, double *walls, double *indoors) {
    Buildings buildings = {0};
    int failed = buildings_set(&buildings, corner, index, corners, height, count);
    for (size_t i = 0; i < n && !failed; i++) {
        Penetration p =
            buildings_penetration(&buildings, position(a + 3 * i), position(b + 3 * i), finite);
        walls[i] = p.walls;
        indoors[i] = p.indoors;
    }
    buildings_free(&buildings);
    return failed;
}

/* `own_a`, `own_b`: index of the body that carries the antenna, or -1. */
EXPORT int shadows(size_t bodies, const double *center, const double *heading, const double *size,
                   bool reciprocal, double factor, size_t n, const double *a, const double *b,
                   const int64_t *own_a, const int64_t *own_b, const double *wavelength,
                   double *loss, bool *blocked) {
    Bodies s = {0};
    int failed = bodies_resize(&s, bodies);
    if (!failed) {
        for (size_t k = 0; k < bodies; k++)
            bodies_put(&s, k, position(center + 3 * k), heading[k], size + 3 * k);
        failed = bodies_index(&s);
    }
    for (size_t i = 0; i < n && !failed; i++) {
        EdgeModel model = {wavelength[i], factor, reciprocal};
        BodyShadow shadow = bodies_shadow(&s, position(a + 3 * i), position(b + 3 * i),
                                          own_a[i] < 0 ? NO_BODY : (size_t)own_a[i],
                                          own_b[i] < 0 ? NO_BODY : (size_t)own_b[i], model);
        loss[i] = shadow.loss_db;
        blocked[i] = shadow.blocked;
    }
    bodies_free(&s);
    return failed;
}

EXPORT double profile_loss(size_t n, const double *distance, const double *height,
                           double wavelength, double factor) {
    Profile profile = {distance, height, n};
    uint32_t *major = malloc(n * sizeof *major);
    double loss = major ? knife_edges_db(&profile, wavelength, factor, major) : NAN;
    free(major);
    return loss;
}

EXPORT int successes(double bitrate, size_t n, const double *snir, const double *bits,
                     double *chunk, double *header, double *payload) {
    const Mode *mode = mode_of_bitrate(bitrate);
    for (size_t i = 0; i < n && mode; i++) {
        chunk[i] = success_probability(mode, snir[i], bits[i]);
        header[i] = header_success_probability(snir[i]);
        payload[i] = payload_success_probability(mode, snir[i], (uint32_t)(bits[i] / 8));
    }
    return mode == NULL;
}

EXPORT int64_t duration(double bitrate, uint32_t size) {
    return frame_duration(mode_of_bitrate(bitrate), size);
}

EXPORT void philox(const uint32_t *counter, const uint32_t *key, uint32_t *out) {
    philox4x32(counter, key, out);
}

EXPORT void uniforms(uint64_t seed, int64_t packet, uint8_t hop, size_t n, double *out) {
    for (size_t i = 0; i < n; i++) {
        Uniforms u = draw(seed, DRAW_RECEPTION, packet, hop, (int64_t)i);
        out[2 * i] = u.first;
        out[2 * i + 1] = u.second;
    }
}
