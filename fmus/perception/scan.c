#include "scan.h"

#include "tilt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static Pose pose_of(const Sensor *sensor, double offset) {
    Pose pose;
    memcpy(pose.position, sensor->position, sizeof pose.position);
    sine_cosine(sensor->heading, &pose.sine, &pose.cosine);
    pose.center[0] = pose.position[0] + offset * pose.cosine;
    pose.center[1] = pose.position[1] + offset * pose.sine;
    return pose;
}

/* ---- the points ----------------------------------------------------------------------------- */

static int clear(Scan *scan, const ScanSettings *settings, uint32_t points, Problem *problem) {
    size_t cells = (size_t)settings->rows * settings->columns;
    if (reserve(&scan->cells, &scan->cell_capacity, cells, sizeof *scan->cells, problem)
        || reserve(&scan->hits, &scan->hit_capacity, points, sizeof *scan->hits, problem)
        || (settings->has_spots
            && reserve(&scan->spots, &scan->spot_capacity, points, sizeof *scan->spots, problem)))
        return 1;
    memset(scan->cells, 0, cells * sizeof *scan->cells);
    scan->cluster_count = scan->hit_count = scan->spot_count = scan->patches.count = 0;
    return 0;
}

static int is_finite(const Point *point) {
    return isfinite(point->position[0]) && isfinite(point->position[1])
           && isfinite(point->position[2]);
}

/* Count the points in the cells of the matrix, and collect those of obstacles in patches. */
static int read_points(Scan *scan, const ScanSettings *settings, const Cloud *cloud,
                       const Sensor *sensor, Problem *problem) {
    const Tilt tilt = tilt_of(sensor);
    const Pose *pose = &scan->pose;
    const double rows = settings->rows, columns = settings->columns;
    const double blanking2 = settings->blanking * settings->blanking;
    const int has_labels = settings->segmentation == BY_LABELS;
    const uint8_t *bytes = cloud->points + (size_t)sensor->first * sizeof(Point);
    for (uint32_t i = 0; i < sensor->count; i++, bytes += sizeof(Point)) {
        Point point;
        memcpy(&point, bytes, sizeof point);
        if (!is_finite(&point))
            return fail(problem, "points: point %u of the sensor of vehicle %lld is (%g, %g, %g)",
                        (unsigned)i, (long long)sensor->vehicle, (double)point.position[0],
                        (double)point.position[1], (double)point.position[2]);
        double p[3] = {point.position[0], point.position[1], point.position[2]};
        double x = tilt.forward[0] * p[0] + tilt.forward[1] * p[1] + tilt.forward[2] * p[2];
        double y = tilt.left[0] * p[0] + tilt.left[1] * p[1] + tilt.left[2] * p[2];
        double height = sensor->position[2] + tilt.up[0] * p[0] + tilt.up[1] * p[1]
                        + tilt.up[2] * p[2];
        double range2 = x * x + y * y;
        if (range2 < blanking2) continue; /* the own body */

        double row = (x - settings->offset) / settings->cell + rows / 2;
        double column = y / settings->cell + columns / 2;
        int is_inside = row >= 0.0 && row < rows && column >= 0.0 && column < columns;
        uint32_t cell = is_inside ? (uint32_t)row * settings->columns + (uint32_t)column : 0;
        if (is_inside && height >= settings->floor && height <= settings->ceiling)
            scan->cells[cell]++;

        if (!(height > settings->ground_height) || !(range2 < FARTHEST * FARTHEST)
            || (has_labels && point.instance == GROUND))
            continue;
        ObstaclePoint seen = {
            .place = {x, y},
            .world = {pose->position[0] + pose->cosine * x - pose->sine * y,
                      pose->position[1] + pose->sine * x + pose->cosine * y},
            .height = height,
            .label = has_labels ? point.instance : 0,
        };
        uint32_t patch;
        if (patches_add(&scan->patches, &seen, &patch, problem)) return 1;
        if (is_inside) scan->hits[scan->hit_count++] = (Hit){cell, patch};
        if (settings->has_spots)
            scan->spots[scan->spot_count++] = (Spot){{(float)x, (float)y}, .part = patch};
    }
    return 0;
}

/* ---- boxes and directions ------------------------------------------------------------------- */

/* Whether a patch that ends at `at` reaches farther than a cluster; among equals the nearest patch is
 * kept, so that the order of patches has no influence. */
static int is_beyond(const Cluster *cluster, const Patch *patch, int side, double at) {
    double beyond = side % 2 ? at - cluster->side[side] : cluster->side[side] - at;
    if (beyond != 0.0) return beyond > 0.0;
    if (patch->range2 != cluster->range2[side]) return patch->range2 < cluster->range2[side];
    return patch->direction < cluster->direction[side];
}

/* Enlarge the box of a cluster by a patch with these sides. */
static void reach(Cluster *cluster, const Patch *patch, uint32_t index, const double at[SIDES]) {
    for (int side = 0; side < SIDES; side++) {
        if (!is_beyond(cluster, patch, side, at[side])) continue;
        cluster->side[side] = at[side];
        cluster->range2[side] = patch->range2;
        cluster->direction[side] = patch->direction;
        cluster->patch[side] = index;
    }
}

static void extend(Cluster *cluster, const Patch *patch, uint32_t index) {
    reach(cluster, patch, index, patch->side);
    if (patch->height > cluster->height) cluster->height = patch->height;
    cluster->points += patch->points;
}

static int is_in_front(const Nearest *nearest, const Patch *patch, uint32_t cluster) {
    if (patch->range2 != nearest->range2) return patch->range2 < nearest->range2;
    if (cluster != nearest->cluster) return cluster < nearest->cluster;
    return patch->height > nearest->height;
}

/* Boxes of the clusters, and what stands in front in each direction. */
static void measure(Scan *scan, const Patch *patches, const uint32_t *cluster_of, size_t count) {
    scan->parts = patches;
    scan->of_part = cluster_of;
    scan->part_count = count;
    for (size_t i = 0; i < BEARINGS; i++)
        scan->nearest[i] = (Nearest){INFINITY, -INFINITY, NO_CLUSTER};
    for (size_t i = 0; i < count; i++) {
        const Patch *patch = &patches[i];
        uint32_t cluster = cluster_of[i];
        if (cluster != NO_CLUSTER) extend(&scan->clusters[cluster], patch, (uint32_t)i);
        Nearest *nearest = &scan->nearest[patch->direction / 2];
        if (is_in_front(nearest, patch, cluster))
            *nearest = (Nearest){patch->range2, patch->height, cluster};
    }
    for (size_t i = 0; i < BEARINGS; i++)
        if (scan->nearest[i].cluster != NO_CLUSTER)
            scan->nearest[i].height = scan->clusters[scan->nearest[i].cluster].height;
}

/* ---- clusters by label ---------------------------------------------------------------------- */

static size_t slot_of(const Scan *scan, int32_t label) {
    uint32_t hash = (uint32_t)label * 2654435769u; /* 2^32 / golden ratio (Knuth) */
    size_t slot = (hash ^ hash >> 15) & (scan->slot_count - 1);
    while (scan->slots[slot] && scan->clusters[scan->slots[slot] - 1].label != label)
        slot = (slot + 1) & (scan->slot_count - 1);
    return slot;
}

static int resize_slots(Scan *scan, size_t count, Problem *problem) {
    if (reserve(&scan->slots, &scan->slot_capacity, count, sizeof *scan->slots, problem)) return 1;
    scan->slot_count = count;
    memset(scan->slots, 0, count * sizeof *scan->slots);
    for (size_t i = 0; i < scan->cluster_count; i++)
        scan->slots[slot_of(scan, scan->clusters[i].label)] = (uint32_t)i + 1;
    return 0;
}

static Cluster empty_cluster(int32_t label) {
    return (Cluster){
        .label = label,
        .axis = {1.0, 0.0},
        .side = {INFINITY, -INFINITY, INFINITY, -INFINITY},
        .height = -INFINITY,
    };
}

static int add_cluster(Scan *scan, int32_t label, size_t slot, Problem *problem) {
    size_t count = scan->cluster_count + 1;
    if (reserve(&scan->clusters, &scan->cluster_capacity, count, sizeof *scan->clusters, problem))
        return 1;
    scan->clusters[scan->cluster_count] = empty_cluster(label);
    scan->slots[slot] = (uint32_t)count;
    scan->cluster_count = count;
    return 2 * count > scan->slot_count ? resize_slots(scan, 2 * scan->slot_count, problem) : 0;
}

/* Patches with one label are a cluster; those of buildings are none. */
static int cluster_by_label(Scan *scan, Problem *problem) {
    if (resize_slots(scan, scan->slot_count ? scan->slot_count : 256, problem)) return 1;
    for (size_t i = 0; i < scan->patches.count; i++) {
        int32_t label = scan->patches.patches[i].label;
        scan->cluster_of[i] = NO_CLUSTER;
        if (label < 0) continue;
        size_t slot = slot_of(scan, label);
        scan->cluster_of[i] =
            scan->slots[slot] ? scan->slots[slot] - 1 : (uint32_t)scan->cluster_count;
        if (!scan->slots[slot] && add_cluster(scan, label, slot, problem)) return 1;
    }
    measure(scan, scan->patches.patches, scan->cluster_of, scan->patches.count);
    return 0;
}

/* ---- clusters by geometry ------------------------------------------------------------------- */

/* Which patches belong to buildings on the map. */
static int find_static(Scan *scan, const ScanSettings *settings, Map *map, Problem *problem) {
    const Patches *patches = &scan->patches;
    const Pose *pose = &scan->pose;
    uint32_t farthest = 0;
    for (size_t i = 0; i < patches->sorted_count; i++)
        if (patches->sorted[i].range > farthest) farthest = patches->sorted[i].range;
    double range = (farthest + 1) * RANGE_STEP + settings->map_margin;
    if (map_focus(map, pose->position, range, problem)) return 1;
    for (size_t i = 0; i < patches->sorted_count; i++) {
        const double *place = patches->sorted[i].place;
        double world[2] = {
            pose->position[0] + pose->cosine * place[0] - pose->sine * place[1],
            pose->position[1] + pose->sine * place[0] + pose->cosine * place[1],
        };
        scan->is_static[i] = (uint8_t)map_covers(map, world, settings->map_margin);
    }
    return 0;
}

/* Whether a surface ends at a patch where it is seen along, in steps so large that its end is
 * between two directions: then that end moves with the sensor. */
static int is_open(const Surroundings *around, uint32_t patch) {
    const double sharp = 0.5; /* [m] */
    double least = INFINITY;
    for (int side = 0; side < 2; side++) {
        uint32_t beside = around[patch].beside[side];
        if (beside == NO_PATCH) continue;
        double step = fabs(around[beside].range - around[patch].range);
        if (step < least) least = step;
    }
    return least > sharp && !isinf(least);
}

static void find_open(Scan *scan) {
    for (size_t i = 0; i < scan->cluster_count; i++)
        for (int side = 0; side < SIDES; side++)
            scan->clusters[i].is_open[side] =
                is_open(scan->segments.search.around, scan->clusters[i].patch[side]);
}

static int cluster_by_geometry(Scan *scan, const ScanSettings *settings, Map *map,
                               Problem *problem) {
    Patches *patches = &scan->patches;
    const Pose *pose = &scan->pose;
    size_t clusters;
    if (patches_sort(patches, problem)
        || reserve(&scan->is_static, &scan->is_static_capacity, patches->sorted_count, 1, problem)
        || reserve(&scan->of_sorted, &scan->of_sorted_capacity, patches->sorted_count,
                   sizeof *scan->of_sorted, problem)
        || find_static(scan, settings, map, problem)
        || segments_find(&scan->segments, &settings->segment, patches, pose->position[2],
                         scan->is_static, scan->of_sorted, &clusters, problem)
        || reserve(&scan->clusters, &scan->cluster_capacity, clusters, sizeof *scan->clusters,
                   problem))
        return 1;
    for (size_t i = 0; i < clusters; i++) scan->clusters[i] = empty_cluster(0);
    scan->cluster_count = clusters;
    for (size_t i = 0; i < patches->count; i++)
        scan->cluster_of[i] = scan->of_sorted[patches->place[i]];
    measure(scan, patches->sorted, scan->of_sorted, patches->sorted_count);
    find_open(scan);
    return 0;
}

/* ---- all of it ------------------------------------------------------------------------------- */

/* Whether clusters are made of sorted patches, by their geometry. */
static int has_segments(const Scan *scan) { return scan->parts == scan->patches.sorted; }

/* From patches to clusters; hits on what is in no cluster are left out. */
static void name_clusters(Scan *scan) {
    size_t kept = 0;
    for (size_t i = 0; i < scan->hit_count; i++) {
        uint32_t cluster = scan->cluster_of[scan->hits[i].cluster];
        if (cluster != NO_CLUSTER) scan->hits[kept++] = (Hit){scan->hits[i].cell, cluster};
    }
    scan->hit_count = kept;
    for (size_t i = 0; i < scan->spot_count; i++) {
        Spot *spot = &scan->spots[i];
        spot->cluster = scan->cluster_of[spot->part];
        if (has_segments(scan)) spot->part = scan->patches.place[spot->part];
    }
}

int scan_take(Scan *scan, const ScanSettings *settings, const Cloud *cloud, const Sensor *sensor,
              Map *map, Problem *problem) {
    scan->pose = pose_of(sensor, settings->offset);
    if (clear(scan, settings, sensor->count, problem)
        || read_points(scan, settings, cloud, sensor, problem)
        || reserve(&scan->cluster_of, &scan->cluster_of_capacity, scan->patches.count,
                   sizeof *scan->cluster_of, problem)
        || (settings->segmentation == BY_LABELS
                ? cluster_by_label(scan, problem)
                : cluster_by_geometry(scan, settings, map, problem)))
        return 1;
    name_clusters(scan);
    return 0;
}

/* ---- sight ---------------------------------------------------------------------------------- */

/* What an obstacle in front leaves to see of a body `range` away [m]: slopes are those of the lines
 * of sight to the highest point of each, and to the foot of the body. */
static Sight sight_past(const Scan *scan, const Nearest *front, const Cluster *body,
                        double range) {
    double sensor = scan->pose.position[2];
    double front_slope = (front->height - sensor) / sqrt(front->range2);
    if (front_slope >= (body->height - sensor) / range - 0.01) return HIDDEN;
    return front_slope >= -sensor / range ? PARTLY_HIDDEN : CLEAR;
}

/* How much of a body an obstacle may hide that is in front of a place of it. */
static Sight sight_at(const Scan *scan, size_t cluster, double range2, uint32_t direction) {
    enum { NEIGHBOURS = 2 };      /* bearings to either side that count as adjacent */
    const double clearance = 0.5; /* [m] by which an obstacle must be nearer to be in front */
    const Cluster *body = &scan->clusters[cluster];
    double range = sqrt(range2);
    if (range <= clearance) return CLEAR;
    Sight worst = CLEAR;
    for (uint32_t step = 0; step <= 2 * NEIGHBOURS; step++) {
        const Nearest *front =
            &scan->nearest[(direction / 2 + BEARINGS - NEIGHBOURS + step) % BEARINGS];
        if (front->cluster == cluster || !(front->range2 > 0.0)
            || !(front->range2 < (range - clearance) * (range - clearance)))
            continue;
        Sight sight = sight_past(scan, front, body, range);
        if (sight < worst) worst = sight;
    }
    return worst;
}

Sight scan_sight(const Scan *scan, size_t cluster, int side) {
    const Cluster *body = &scan->clusters[cluster];
    Sight sight = body->is_open[side]
                      ? HIDDEN
                      : sight_at(scan, cluster, body->range2[side], body->direction[side]);
    return sight > body->face[side] ? sight : (Sight)body->face[side];
}

/* How far a place is inside the side that faces the sensor, along one axis, levelled frame [m]; infinite
 * if the sensor is beside neither. `*side` is which one. */
static double behind_face(const Cluster *cluster, int axis, double at, int *side) {
    const double low = cluster->side[2 * axis], high = cluster->side[2 * axis + 1];
    *side = 2 * axis + (high < 0.0);
    return low > 0.0 ? at - low : high < 0.0 ? high - at : INFINITY;
}

/* A side that faces the sensor is a face of the body, wherever one sees it: it is as clear as the
 * clearest patch that lies on it and not on the flank, where a shadow may have cut it off. */
static void find_faces(Scan *scan, const double (*axes)[2]) {
    const double thick = 0.15, aside = 0.3; /* [m] */
    for (size_t i = 0; i < scan->part_count; i++) {
        const uint32_t k = scan->of_part[i];
        if (k == NO_CLUSTER) continue;
        const Patch *patch = &scan->parts[i];
        Cluster *cluster = &scan->clusters[k];
        const double *axis = axes[k], x = patch->place[0], y = patch->place[1];
        const double at[2] = {axis[0] * x + axis[1] * y, axis[0] * y - axis[1] * x};
        int side[2];
        const double behind[2] = {behind_face(cluster, 0, at[0], &side[0]),
                                  behind_face(cluster, 1, at[1], &side[1])};
        for (int own = 0; own < 2; own++) {
            uint32_t *face = &cluster->face[side[own]];
            if (behind[own] > thick || behind[!own] < aside || *face == CLEAR) continue;
            Sight sight = sight_at(scan, k, patch->range2, patch->direction);
            if (sight > *face) *face = sight;
        }
    }
}

/* The sides in the world of a cluster that has those of the levelled frame. */
static void shift_sides(Cluster *cluster, const Pose *pose) {
    const double *axis = cluster->axis;
    const double origin[2] = {axis[0] * pose->position[0] + axis[1] * pose->position[1],
                              axis[0] * pose->position[1] - axis[1] * pose->position[0]};
    for (int side = 0; side < SIDES; side++) cluster->side[side] += origin[side / 2];
}

void scan_turn(Scan *scan, const double (*axes)[2]) {
    const Pose *pose = &scan->pose;
    for (size_t k = 0; k < scan->cluster_count; k++) {
        Cluster *cluster = &scan->clusters[k];
        cluster->axis[0] = pose->cosine * axes[k][0] - pose->sine * axes[k][1];
        cluster->axis[1] = pose->sine * axes[k][0] + pose->cosine * axes[k][1];
        for (int side = 0; side < SIDES; side++)
            cluster->side[side] = side % 2 ? -INFINITY : INFINITY;
    }
    for (size_t i = 0; i < scan->spot_count; i++) {
        const Spot *spot = &scan->spots[i];
        if (spot->cluster == NO_CLUSTER) continue;
        const double *axis = axes[spot->cluster], x = spot->place[0], y = spot->place[1];
        const double u = axis[0] * x + axis[1] * y, v = axis[0] * y - axis[1] * x;
        Cluster *cluster = &scan->clusters[spot->cluster];
        const double *side = cluster->side;
        if (u > side[0] && u < side[1] && v > side[2] && v < side[3]) continue; /* as most are */
        reach(cluster, &scan->parts[spot->part], spot->part, (double[SIDES]){u, u, v, v});
    }
    find_faces(scan, axes);
    for (size_t k = 0; k < scan->cluster_count; k++) shift_sides(&scan->clusters[k], pose);
    if (has_segments(scan)) find_open(scan);
}

void scan_free(Scan *scan) {
    free(scan->cells);
    free(scan->clusters);
    free(scan->hits);
    free(scan->spots);
    free(scan->cluster_of);
    free(scan->is_static);
    free(scan->of_sorted);
    free(scan->slots);
    patches_free(&scan->patches);
    segments_free(&scan->segments);
}
