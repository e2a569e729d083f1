#include "scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Levelled frame (x along the heading, z up, origin at the sensor) <- sensor frame. */
typedef struct {
    double forward[3], left[3], up[3];
} Tilt;

static Tilt tilt_of(const Sensor *sensor) {
    double sp, cp, sr, cr;
    sine_cosine(sensor->pitch, &sp, &cp);
    sine_cosine(sensor->roll, &sr, &cr);
    /* turn about x by the roll, then about y by the pitch */
    return (Tilt){
        .forward = {cp, sp * sr, sp * cr},
        .left = {0.0, cr, -sr},
        .up = {-sp, cp * sr, cp * cr},
    };
}

static Pose pose_of(const Sensor *sensor, double offset) {
    Pose pose;
    memcpy(pose.position, sensor->position, sizeof pose.position);
    sine_cosine(sensor->heading, &pose.sine, &pose.cosine);
    pose.center[0] = pose.position[0] + offset * pose.cosine;
    pose.center[1] = pose.position[1] + offset * pose.sine;
    return pose;
}

/* ---- clusters by instance ------------------------------------------------------------------- */

static size_t slot_of(const Scan *scan, int32_t instance) {
    uint32_t hash = (uint32_t)instance * 2654435769u; /* 2^32 / golden ratio (Knuth) */
    size_t slot = (hash ^ hash >> 15) & (scan->slot_count - 1);
    while (scan->slots[slot] && scan->clusters[scan->slots[slot] - 1].instance != instance)
        slot = (slot + 1) & (scan->slot_count - 1);
    return slot;
}

static int resize_slots(Scan *scan, size_t count, Problem *problem) {
    if (reserve(&scan->slots, &scan->slot_capacity, count, sizeof *scan->slots, problem)) return 1;
    scan->slot_count = count;
    memset(scan->slots, 0, count * sizeof *scan->slots);
    for (size_t i = 0; i < scan->cluster_count; i++)
        scan->slots[slot_of(scan, scan->clusters[i].instance)] = (uint32_t)i + 1;
    return 0;
}

static int add_cluster(Scan *scan, int32_t instance, size_t slot, Problem *problem) {
    size_t count = scan->cluster_count + 1;
    if (reserve(&scan->clusters, &scan->cluster_capacity, count, sizeof *scan->clusters, problem))
        return 1;
    scan->clusters[scan->cluster_count] = (Cluster){
        .instance = instance,
        .side = {INFINITY, -INFINITY, INFINITY, -INFINITY},
        .height = -INFINITY,
    };
    scan->slots[slot] = (uint32_t)count;
    scan->cluster_count = count;
    return 2 * count > scan->slot_count ? resize_slots(scan, 2 * scan->slot_count, problem) : 0;
}

/* The cluster of `instance`, made if there is none yet. */
static int find_cluster(Scan *scan, int32_t instance, uint32_t *cluster, Problem *problem) {
    size_t slot = slot_of(scan, instance);
    if (!scan->slots[slot]) {
        *cluster = (uint32_t)scan->cluster_count;
        return add_cluster(scan, instance, slot, problem);
    }
    *cluster = scan->slots[slot] - 1;
    return 0;
}

/* ---- directions ----------------------------------------------------------------------------- */

/* Index of a direction: the perimeter of the unit diamond |x| + |y| = 1, monotonic in the azimuth
 * and cheaper than an arc tangent; 0.22 to 0.45 degrees per index. */
static uint32_t bearing_of(double x, double y) {
    double sum = fabs(x) + fabs(y);
    if (!(sum > 0.0)) return 0;
    double along = y / sum;
    if (x < 0.0) along = (y < 0.0 ? -2.0 : 2.0) - along;
    return (uint32_t)((along + 2.0) * (BEARINGS / 4.0)) % BEARINGS;
}

/* ---- the pass ------------------------------------------------------------------------------- */

static void extend(Cluster *cluster, const double world[2], double height, double range2,
                   uint32_t bearing) {
    double beyond[SIDES] = {
        [X_MINIMUM] = cluster->side[X_MINIMUM] - world[0],
        [X_MAXIMUM] = world[0] - cluster->side[X_MAXIMUM],
        [Y_MINIMUM] = cluster->side[Y_MINIMUM] - world[1],
        [Y_MAXIMUM] = world[1] - cluster->side[Y_MAXIMUM],
    };
    for (int side = 0; side < SIDES; side++) {
        if (!(beyond[side] > 0.0)) continue;
        cluster->side[side] = world[side / 2];
        cluster->range2[side] = range2;
        cluster->bearing[side] = bearing;
    }
    if (height > cluster->height) cluster->height = height;
    cluster->points++;
}

/* Add a point of an obstacle. `x` and `y` are in the levelled frame. */
static void add_obstacle(Scan *scan, uint32_t index, double x, double y, double height) {
    const Pose *pose = &scan->pose;
    double world[2] = {
        pose->position[0] + pose->cosine * x - pose->sine * y,
        pose->position[1] + pose->sine * x + pose->cosine * y,
    };
    double range2 = x * x + y * y;
    uint32_t bearing = bearing_of(x, y);
    extend(&scan->clusters[index], world, height, range2, bearing);
    if (range2 < scan->nearest[bearing].range2) scan->nearest[bearing] = (Nearest){range2, index};
}

static int clear(Scan *scan, const ScanSettings *settings, uint32_t points, Problem *problem) {
    size_t cells = (size_t)settings->rows * settings->columns;
    if (reserve(&scan->cells, &scan->cell_capacity, cells, sizeof *scan->cells, problem)
        || reserve(&scan->hits, &scan->hit_capacity, points, sizeof *scan->hits, problem))
        return 1;
    memset(scan->cells, 0, cells * sizeof *scan->cells);
    scan->cluster_count = scan->hit_count = 0;
    for (size_t i = 0; i < BEARINGS; i++) scan->nearest[i] = (Nearest){INFINITY, 0};
    return resize_slots(scan, scan->slot_count ? scan->slot_count : 256, problem);
}

static int is_finite(const Point *point) {
    return isfinite(point->position[0]) && isfinite(point->position[1])
           && isfinite(point->position[2]);
}

int scan_take(Scan *scan, const ScanSettings *settings, const Cloud *cloud, const Sensor *sensor,
              Problem *problem) {
    if (clear(scan, settings, sensor->count, problem)) return 1;
    scan->pose = pose_of(sensor, settings->offset);
    const Tilt tilt = tilt_of(sensor);
    const double rows = settings->rows, columns = settings->columns;
    const uint8_t *bytes = cloud->points + (size_t)sensor->first * sizeof(Point);
    int32_t last_instance = GROUND;
    uint32_t cluster = 0;
    for (uint32_t i = 0; i < sensor->count; i++, bytes += sizeof(Point)) {
        Point point;
        memcpy(&point, bytes, sizeof point);
        if (!is_finite(&point))
            return fail(problem, "points: point %u of the sensor of vehicle %lld is (%g, %g, %g)",
                        (unsigned)i, (long long)sensor->vehicle, (double)point.position[0],
                        (double)point.position[1], (double)point.position[2]);
        if (point.instance == sensor->vehicle) continue; /* the own body */
        double p[3] = {point.position[0], point.position[1], point.position[2]};
        double x = tilt.forward[0] * p[0] + tilt.forward[1] * p[1] + tilt.forward[2] * p[2];
        double y = tilt.left[0] * p[0] + tilt.left[1] * p[1] + tilt.left[2] * p[2];
        double height = sensor->position[2] + tilt.up[0] * p[0] + tilt.up[1] * p[1]
                        + tilt.up[2] * p[2];

        double row = (x - settings->offset) / settings->cell + rows / 2;
        double column = y / settings->cell + columns / 2;
        int is_inside = row >= 0.0 && row < rows && column >= 0.0 && column < columns;
        uint32_t cell = is_inside ? (uint32_t)row * settings->columns + (uint32_t)column : 0;
        if (is_inside && height >= settings->floor && height <= settings->ceiling)
            scan->cells[cell]++;

        if (point.instance == GROUND || !(height > settings->ground_height)) continue;
        if (point.instance != last_instance || scan->cluster_count == 0) {
            if (find_cluster(scan, point.instance, &cluster, problem)) return 1;
            last_instance = point.instance;
        }
        add_obstacle(scan, cluster, x, y, height);
        if (is_inside) scan->hits[scan->hit_count++] = (Hit){cell, cluster};
    }
    return 0;
}

/* What an obstacle in front leaves to see of a body `range` away [m]: slopes are those of the lines
 * of sight to the highest point of each, and to the foot of the body. */
static Sight sight_past(const Scan *scan, const Nearest *front, const Cluster *body,
                        double range) {
    double sensor = scan->pose.position[2];
    double front_slope =
        (scan->clusters[front->cluster].height - sensor) / sqrt(front->range2);
    if (front_slope >= (body->height - sensor) / range - 0.01) return HIDDEN;
    return front_slope >= -sensor / range ? PARTLY_HIDDEN : CLEAR;
}

Sight scan_sight(const Scan *scan, size_t cluster, int side) {
    enum { NEIGHBOURS = 2 };      /* bearings to either side that count as adjacent */
    const double clearance = 0.5; /* [m] by which an obstacle must be nearer to be in front */
    const Cluster *body = &scan->clusters[cluster];
    double range = sqrt(body->range2[side]);
    if (range <= clearance) return CLEAR;
    Sight worst = CLEAR;
    for (uint32_t step = 0; step <= 2 * NEIGHBOURS; step++) {
        const Nearest *front =
            &scan->nearest[(body->bearing[side] + BEARINGS - NEIGHBOURS + step) % BEARINGS];
        if (front->cluster == cluster || !(front->range2 > 0.0)
            || !(front->range2 < (range - clearance) * (range - clearance)))
            continue;
        Sight sight = sight_past(scan, front, body, range);
        if (sight < worst) worst = sight;
    }
    return worst;
}

void scan_free(Scan *scan) {
    free(scan->cells);
    free(scan->clusters);
    free(scan->hits);
    free(scan->slots);
}
