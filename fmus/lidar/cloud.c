#include "cloud.h"

#include <math.h>

#include "portable_math.h"
#include "random.h"

/* Extinction of the returned light [1/m]; CARLA's default, `atmosphere_attenuation_rate`. */
#define ATTENUATION 0.004

/* Rays that are handled together: what is known of them fits into the fastest memory. */
enum { BLOCK = 64 };

/* Rays of one azimuth that are reported. */
typedef struct {
    uint32_t channel[BLOCK], face[BLOCK], bits[BLOCK];
    double nearness[BLOCK];  /* 1 / distance along the ray [1/m] */
    double reflected[BLOCK]; /* reflectivity x distance of the plane [m] */
    double error[BLOCK];     /* of the distance, in standard deviations */
    double measured[BLOCK];  /* distance [m] */
    float intensity[BLOCK];
    uint32_t count;
} Reported;

/* exp(-ATTENUATION * range) as exp(-u)^16 with the Taylor series of the small u; the relative error
 * is below 2e-9 up to 250 m and 6e-6 at 1000 m. */
static double transmission(double range) {
    double u = range * (ATTENUATION / 16);
    double x = 1.0 - u * (1.0 - u * (1.0 / 2 - u * (1.0 / 6 - u * (1.0 / 24 - u / 120))));
    x *= x;
    x *= x;
    x *= x;
    return x * x;
}

/* The hits among up to BLOCK rays that are not lost. Without branches that depend on the data:
 * every ray is written, and the next one over it if it is not to be reported. */
static void select(const Pattern *pattern, const Hits *hits, uint32_t azimuth, uint32_t first,
                   uint32_t rays, uint64_t key, uint64_t dropped, Reported *reported) {
    size_t row = (size_t)azimuth * pattern->parameters.channels;
    uint32_t count = 0;
    for (uint32_t k = first; k < first + rays; k++) {
        uint64_t bits = ray_bits(key, azimuth, k);
        reported->channel[count] = k;
        reported->face[count] = hits->face[row + k];
        reported->nearness[count] = hits->nearness[row + k] * pattern->level[k];
        reported->bits[count] = (uint32_t)(bits >> 32);
        count += (hits->face[row + k] != NOTHING) & ((bits & UINT32_MAX) >= dropped);
    }
    reported->count = count;
}

/* The cosine of the angle of incidence is the distance of the plane over that along the ray. */
static void measure(const View *view, double range_noise, Reported *reported) {
    for (uint32_t i = 0; i < reported->count; i++) {
        const Face *face = view->face + reported->face[i];
        reported->reflected[i] = face->surface.reflectivity * face->distance;
    }
    standard_normals(reported->bits, reported->count, reported->error);
    for (uint32_t i = 0; i < reported->count; i++) {
        double nearness = reported->nearness[i], range = 1.0 / nearness;
        double measured = range + range_noise * reported->error[i];
        reported->intensity[i] = (float)(reported->reflected[i] * nearness * transmission(range));
        reported->measured[i] = measured > 0.0 ? measured : 0.0;
    }
}

static void write(const View *view, const Pattern *pattern, uint32_t azimuth,
                  const Reported *reported, Point *points) {
    double x = pattern->azimuth_x[azimuth], y = pattern->azimuth_y[azimuth];
    for (uint32_t i = 0; i < reported->count; i++) {
        uint32_t k = reported->channel[i];
        double measured = reported->measured[i], level = measured * pattern->level[k];
        points[i] = (Point){
            .position = {(float)(level * x), (float)(level * y),
                         (float)(measured * pattern->rise[k])},
            .intensity = reported->intensity[i],
            .instance = view->face[reported->face[i]].surface.instance,
        };
    }
}

uint32_t cloud_points(const View *view, const Pattern *pattern, const Hits *hits, uint32_t azimuth,
                      const Noise *noise, uint64_t key, Point *points) {
    uint64_t dropped = (uint64_t)(noise->dropout * 0x1p32); /* of 2^32 */
    uint32_t channels = pattern->parameters.channels, count = 0;
    Reported reported;
    for (uint32_t first = 0; first < channels; first += BLOCK) {
        uint32_t rays = channels - first < BLOCK ? channels - first : BLOCK;
        select(pattern, hits, azimuth, first, rays, key, dropped, &reported);
        measure(view, noise->range_noise, &reported);
        write(view, pattern, azimuth, &reported, points + count);
        count += reported.count;
    }
    return count;
}
