#include "boxes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Box angles relative to the sensor are counted in steps of 0.09 degrees. */
enum { QUARTER_TURN = 1024, COARSE_STEP = QUARTER_TURN / 16 };
/* Points by which the angle of a cluster is found: as many or more, if it has them. */
enum { SAMPLE = 64 };
#define FAR_FROM_FACES 0.25f /* [m]; points farther inside all count alike */

/* ---- the sample ----------------------------------------------------------------------------- */

/* A number that says nothing about the place of a point. */
static uint32_t scrambled(const float place[2]) {
    uint32_t bits[2];
    memcpy(bits, place, sizeof bits);
    uint32_t hash = bits[0] * 2654435769u ^ bits[1]; /* 2^32 / golden ratio (Knuth) */
    hash ^= hash >> 15;
    hash *= 2246822519u; /* finalizer of xxHash32 */
    hash ^= hash >> 13;
    hash *= 3266489917u;
    return hash ^ hash >> 16;
}

/* The largest power of two, as a mask, that leaves a sample. */
static uint32_t mask_of(uint32_t points) {
    uint32_t one_of = 1;
    while (points / (2 * one_of) >= SAMPLE) one_of *= 2;
    return one_of - 1;
}

/* Which points are taken depends on where they are alone, not on their order. */
static int sample(Boxes *boxes, const Scan *scan, uint32_t minimum_points, Problem *problem) {
    size_t places = 0;
    for (size_t k = 0; k < scan->cluster_count; k++) {
        const uint32_t points = scan->clusters[k].points;
        boxes->samples[k] = (Sample){.first = places, .mask = mask_of(points)};
        if (points >= minimum_points) places += points;
    }
    for (int axis = 0; axis < 2; axis++)
        if (reserve(&boxes->place[axis], &boxes->place_capacity[axis], places, sizeof(float),
                    problem))
            return 1;
    for (size_t i = 0; i < scan->spot_count; i++) {
        const Spot *spot = &scan->spots[i];
        if (spot->cluster == NO_CLUSTER || scan->clusters[spot->cluster].points < minimum_points)
            continue;
        Sample *taken = &boxes->samples[spot->cluster];
        if (scrambled(spot->place) & taken->mask) continue;
        size_t place = taken->first + taken->count++;
        for (int axis = 0; axis < 2; axis++) boxes->place[axis][place] = spot->place[axis];
    }
    return 0;
}

/* ---- the angle ------------------------------------------------------------------------------ */

static float smaller(float a, float b) { return a < b ? a : b; }
static float larger(float a, float b) { return a > b ? a : b; }

typedef struct {
    float low[2], high[2];
} Extent;

static void along(const float *const place[2], size_t i, const float axis[2], float *u, float *v) {
    *u = axis[0] * place[0][i] + axis[1] * place[1][i];
    *v = axis[0] * place[1][i] - axis[1] * place[0][i];
}

/* How badly points fit the faces, towards the sensor, of a box of this angle: the sum of their
 * squared distances to the nearer one, bounded. It is a sum of integers, so that no order of the
 * points changes it.
 *
 * L-shape fitting by search over the angle, with the squared distances to the edges as criterion
 * (Zhang, Xu, Dong, Dolan, Efficient L-Shape Fitting for Vehicle Detection Using Laser Scanners,
 * IEEE IV 2017, section III); bounded, because a lidar sees roofs, too. */
static uint64_t misfit(const float *const place[2], size_t count, uint32_t angle) {
    double sine, cosine;
    sine_cosine(PI / 2 / QUARTER_TURN * angle, &sine, &cosine);
    const float axis[2] = {(float)cosine, (float)sine};
    Extent extent = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (size_t i = 0; i < count; i++) {
        float u, v;
        along(place, i, axis, &u, &v);
        extent.low[0] = smaller(extent.low[0], u);
        extent.high[0] = larger(extent.high[0], u);
        extent.low[1] = smaller(extent.low[1], v);
        extent.high[1] = larger(extent.high[1], v);
    }
    float face[2], inwards[2];
    for (int k = 0; k < 2; k++) {
        int is_low = fabsf(extent.low[k]) < fabsf(extent.high[k]);
        face[k] = is_low ? extent.low[k] : extent.high[k];
        inwards[k] = is_low ? 1.0f : -1.0f;
    }
    uint64_t sum = 0;
    for (size_t i = 0; i < count; i++) {
        float u, v;
        along(place, i, axis, &u, &v);
        float d = smaller(inwards[0] * (u - face[0]), inwards[1] * (v - face[1]));
        d = smaller(d, FAR_FROM_FACES);
        sum += (uint32_t)(int32_t)(d * d * (float)(1 << 24)); /* below 2^20 */
    }
    return sum;
}

/* The angle that fits best, from sixteen over a quarter turn, then ever nearer ones. */
static uint32_t angle_of(const float *const place[2], size_t count) {
    uint32_t best = 0;
    uint64_t least = UINT64_MAX;
    if (count == 0) return best;
    for (uint32_t angle = 0; angle < QUARTER_TURN; angle += COARSE_STEP) {
        uint64_t found = misfit(place, count, angle);
        if (found < least) least = found, best = angle;
    }
    for (uint32_t step = COARSE_STEP / 2; step > 0; step /= 2) {
        uint32_t center = best;
        for (uint32_t side = 0; side < 2; side++) {
            uint32_t angle = (center + (side ? step : QUARTER_TURN - step)) % QUARTER_TURN;
            uint64_t found = misfit(place, count, angle);
            if (found < least) least = found, best = angle;
        }
    }
    return best;
}

/* ---- the boxes ------------------------------------------------------------------------------ */

static Turned turned_by(uint32_t angle) {
    Turned turned = {.angle = PI / 2 / QUARTER_TURN * angle,
                     .low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
    sine_cosine(turned.angle, &turned.axis[1], &turned.axis[0]);
    return turned;
}

static void extend(Turned *turned, const float place[2]) {
    const double x = place[0], y = place[1], *axis = turned->axis;
    const double at[2] = {axis[0] * x + axis[1] * y, axis[0] * y - axis[1] * x};
    for (int k = 0; k < 2; k++) {
        turned->low[k] = at[k] < turned->low[k] ? at[k] : turned->low[k];
        turned->high[k] = at[k] > turned->high[k] ? at[k] : turned->high[k];
    }
}

/* The box in the world. Its first side is the one whose direction lies in the first quarter. */
static Box in_world(const Turned *turned, const Pose *pose, double heading) {
    const double *axis = turned->axis, sum = heading + turned->angle;
    double quarters = floor(sum / (PI / 2)), rest = sum - PI / 2 * quarters;
    if (rest >= PI / 2) quarters++, rest = 0.0; /* by rounding */
    if (rest < 0.0) rest = 0.0;
    const int is_swapped = fmod(quarters, 2.0) != 0.0;
    double middle[2];
    Box box = {.angle = rest};
    for (int k = 0; k < 2; k++) {
        middle[k] = 0.5 * (turned->low[k] + turned->high[k]);
        box.size[k ^ is_swapped] = turned->high[k] - turned->low[k];
    }
    const double x = axis[0] * middle[0] - axis[1] * middle[1];
    const double y = axis[1] * middle[0] + axis[0] * middle[1];
    box.position[0] = pose->position[0] + pose->cosine * x - pose->sine * y;
    box.position[1] = pose->position[1] + pose->sine * x + pose->cosine * y;
    return box;
}

static Box around(const Cluster *cluster) {
    const double *side = cluster->side;
    return (Box){
        .position = {0.5 * (side[X_MINIMUM] + side[X_MAXIMUM]),
                     0.5 * (side[Y_MINIMUM] + side[Y_MAXIMUM])},
        .size = {side[X_MAXIMUM] - side[X_MINIMUM], side[Y_MAXIMUM] - side[Y_MINIMUM]},
    };
}

static int fit(Boxes *boxes, const Sensor *sensor, const Scan *scan, uint32_t minimum_points,
               Problem *problem) {
    size_t clusters = scan->cluster_count;
    if (reserve(&boxes->samples, &boxes->sample_capacity, clusters, sizeof(Sample), problem)
        || reserve(&boxes->turned, &boxes->turned_capacity, clusters, sizeof(Turned), problem)
        || sample(boxes, scan, minimum_points, problem))
        return 1;
    for (size_t k = 0; k < clusters; k++) {
        const Sample *sample = &boxes->samples[k];
        const float *const place[2] = {boxes->place[0] + sample->first,
                                       boxes->place[1] + sample->first};
        boxes->turned[k] = turned_by(angle_of(place, sample->count));
    }
    for (size_t i = 0; i < scan->spot_count; i++)
        if (scan->spots[i].cluster != NO_CLUSTER)
            extend(&boxes->turned[scan->spots[i].cluster], scan->spots[i].place);
    for (size_t k = 0; k < clusters; k++)
        boxes->boxes[k] = in_world(&boxes->turned[k], &scan->pose, sensor->heading);
    return 0;
}

int boxes_find(Boxes *boxes, BoxKind kind, const Sensor *sensor, const Scan *scan,
               uint32_t minimum_points, Problem *problem) {
    if (reserve(&boxes->boxes, &boxes->box_capacity, scan->cluster_count, sizeof(Box), problem))
        return 1;
    if (kind == FITTED) return fit(boxes, sensor, scan, minimum_points, problem);
    for (size_t k = 0; k < scan->cluster_count; k++)
        boxes->boxes[k] = around(&scan->clusters[k]);
    return 0;
}

void boxes_free(Boxes *boxes) {
    for (int axis = 0; axis < 2; axis++) free(boxes->place[axis]);
    free(boxes->samples);
    free(boxes->turned);
    free(boxes->boxes);
}
