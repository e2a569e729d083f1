#include "boxes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Box angles relative to the sensor are counted in steps of 0.09 degrees. */
enum { QUARTER_TURN = 1024, COARSE_STEP = QUARTER_TURN / 16 };
/* Points by which the angle of a cluster is found: as many or more, if it has them. */
enum { SAMPLE = 64 };
#define FAR_FROM_FACES 0.25f /* [m]; points farther inside all count alike */
#define SQUARE_METRE (1 << 24) /* unit of sums of squares, in counts */
#define NEARLY (SQUARE_METRE / 1000) /* so much worse per point, (3 cm)^2, is nearly as good */

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

/* The sample of one cluster, levelled frame [m]. */
typedef struct {
    const float *place[2];
    size_t count;
} Points;

static void along(const float *const place[2], size_t i, const float axis[2], float *u, float *v) {
    *u = axis[0] * place[0][i] + axis[1] * place[1][i];
    *v = axis[0] * place[1][i] - axis[1] * place[0][i];
}

/* How badly points fit the faces, towards the sensor, of a box of this angle: the sum of their
 * squared distances to the nearer one, bounded. It is a sum of integers, so that no order of the
 * points changes it. `*extent` becomes the extent of the points.
 *
 * L-shape fitting by search over the angle, with the squared distances to the edges as criterion
 * (Zhang, Xu, Dong, Dolan, Efficient L-Shape Fitting for Vehicle Detection Using Laser Scanners,
 * IEEE IV 2017, section III); bounded, because a lidar sees roofs, too. */
static uint64_t misfit(const Points *points, const double unit[2], Extent *extent) {
    const float *const *place = points->place, axis[2] = {(float)unit[0], (float)unit[1]};
    const size_t count = points->count;
    *extent = (Extent){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (size_t i = 0; i < count; i++) {
        float u, v;
        along(place, i, axis, &u, &v);
        extent->low[0] = smaller(extent->low[0], u);
        extent->high[0] = larger(extent->high[0], u);
        extent->low[1] = smaller(extent->low[1], v);
        extent->high[1] = larger(extent->high[1], v);
    }
    float face[2], inwards[2];
    for (int k = 0; k < 2; k++) {
        int is_low = fabsf(extent->low[k]) < fabsf(extent->high[k]);
        face[k] = is_low ? extent->low[k] : extent->high[k];
        inwards[k] = is_low ? 1.0f : -1.0f;
    }
    uint64_t sum = 0;
    for (size_t i = 0; i < count; i++) {
        float u, v;
        along(place, i, axis, &u, &v);
        float d = smaller(inwards[0] * (u - face[0]), inwards[1] * (v - face[1]));
        d = smaller(d, FAR_FROM_FACES);
        sum += (uint32_t)(int32_t)(d * d * (float)SQUARE_METRE); /* below 2^20 */
    }
    return sum;
}

/* The better of two directions. */
static void take_better(Orientation *best, const Points *points, uint32_t angle) {
    Orientation found = {.angle = angle % QUARTER_TURN};
    sine_cosine(PI / 2 / QUARTER_TURN * found.angle, &found.axis[1], &found.axis[0]);
    found.misfit = misfit(points, found.axis, &found.extent);
    if (found.misfit < best->misfit) *best = found;
}

/* The direction of the first side that fits best, from sixteen, then ever nearer ones. */
static Orientation best_orientation(const Points *points) {
    Orientation best = {.misfit = UINT64_MAX, .axis = {1.0, 0.0}};
    if (points->count == 0) return best;
    for (uint32_t angle = 0; angle < QUARTER_TURN; angle += COARSE_STEP)
        take_better(&best, points, angle);
    for (uint32_t step = COARSE_STEP / 2; step > 0; step /= 2) {
        uint32_t center = best.angle;
        take_better(&best, points, center + QUARTER_TURN - step);
        take_better(&best, points, center + step);
    }
    return best;
}

static float diagonal2(const Extent *extent) {
    float u = extent->high[0] - extent->low[0], v = extent->high[1] - extent->low[1];
    return u * u + v * v;
}

/* Whether a former direction is to be kept: it fits nearly as well as the best one, for a body does not
 * turn because of the noise; or the body is small, for pieces, persons and riders have no clear one. */
static int keeps_orientation(const Orientation *best, const Points *points, const double former[2]) {
    const float small = 2.0f; /* diagonal [m] */
    Extent extent;
    return points->count == 0 || diagonal2(&best->extent) < small * small
           || misfit(points, former, &extent) <= best->misfit + points->count * NEARLY;
}

static Points points_of(const Boxes *boxes, size_t cluster) {
    const Sample *sample = &boxes->samples[cluster];
    return (Points){
        .place = {boxes->place[0] + sample->first, boxes->place[1] + sample->first},
        .count = sample->count,
    };
}

int boxes_fit(Boxes *boxes, const Scan *scan, uint32_t minimum_points, Problem *problem) {
    size_t clusters = scan->cluster_count;
    if (reserve(&boxes->samples, &boxes->sample_capacity, clusters, sizeof(Sample), problem)
        || reserve(&boxes->best, &boxes->best_capacity, clusters, sizeof(Orientation), problem)
        || sample(boxes, scan, minimum_points, problem))
        return 1;
    for (size_t k = 0; k < clusters; k++) {
        const Points points = points_of(boxes, k);
        boxes->best[k] = best_orientation(&points);
    }
    return 0;
}

void boxes_middle(const Boxes *boxes, const Scan *scan, size_t cluster, double place[2]) {
    const Orientation *best = &boxes->best[cluster];
    const Extent *extent = &best->extent;
    const double u = 0.5 * ((double)extent->low[0] + extent->high[0]);
    const double v = 0.5 * ((double)extent->low[1] + extent->high[1]);
    const double x = best->axis[0] * u - best->axis[1] * v;
    const double y = best->axis[1] * u + best->axis[0] * v;
    const Pose *pose = &scan->pose;
    place[0] = pose->position[0] + pose->cosine * x - pose->sine * y;
    place[1] = pose->position[1] + pose->sine * x + pose->cosine * y;
}

/* ---- the boxes ------------------------------------------------------------------------------ */

/* A direction in the world as one in the first quarter of the levelled frame. */
static void level(double axis[2], const double *world, const Pose *pose) {
    axis[0] = pose->cosine * world[0] + pose->sine * world[1];
    axis[1] = pose->cosine * world[1] - pose->sine * world[0];
    while (!(axis[0] > 0.0 && axis[1] >= 0.0)) {
        double turned = -axis[0]; /* by a quarter turn back */
        axis[0] = axis[1];
        axis[1] = turned;
    }
}

int boxes_turn(Boxes *boxes, Scan *scan, const double *const *former_axes, Problem *problem) {
    if (reserve(&boxes->axes, &boxes->axis_capacity, scan->cluster_count, sizeof *boxes->axes,
                problem))
        return 1;
    for (size_t k = 0; k < scan->cluster_count; k++) {
        const Points points = points_of(boxes, k);
        const Orientation *best = &boxes->best[k];
        double former[2];
        memcpy(boxes->axes[k], best->axis, sizeof *boxes->axes);
        if (!former_axes[k]) continue;
        level(former, former_axes[k], &scan->pose);
        if (keeps_orientation(best, &points, former)) memcpy(boxes->axes[k], former, sizeof former);
    }
    scan_turn(scan, (const double(*)[2])boxes->axes);
    return 0;
}

Box box_of(const Cluster *cluster) {
    const double *side = cluster->side, *axis = cluster->axis;
    const double sum = direction_angle(axis[1], axis[0]);
    double quarters = floor(sum / (PI / 2)), rest = sum - PI / 2 * quarters;
    if (rest >= PI / 2) quarters++, rest = 0.0; /* by rounding */
    if (rest < 0.0) rest = 0.0;
    const double u = 0.5 * (side[0] + side[1]), v = 0.5 * (side[2] + side[3]);
    const double size[2] = {side[1] - side[0], side[3] - side[2]};
    const int is_odd = (int)fmod(fabs(quarters), 2.0);
    return (Box){
        .position = {axis[0] * u - axis[1] * v, axis[1] * u + axis[0] * v},
        .angle = rest,
        .size = {size[is_odd], size[!is_odd]},
    };
}

void boxes_free(Boxes *boxes) {
    for (int axis = 0; axis < 2; axis++) free(boxes->place[axis]);
    free(boxes->samples);
    free(boxes->best);
    free(boxes->axes);
}
