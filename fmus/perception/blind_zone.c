#include "blind_zone.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- where to search ------------------------------------------------------------------------ */

static double squared_distance(const double p[2], const double a[2], const double b[2]) {
    double ab[2] = {b[0] - a[0], b[1] - a[1]}, ap[2] = {p[0] - a[0], p[1] - a[1]};
    double length2 = ab[0] * ab[0] + ab[1] * ab[1];
    double along = length2 > 0.0 ? (ap[0] * ab[0] + ap[1] * ab[1]) / length2 : 0.0;
    along = along < 0.0 ? 0.0 : along > 1.0 ? 1.0 : along;
    double x = ap[0] - along * ab[0], y = ap[1] - along * ab[1];
    return x * x + y * y;
}

/* Whether a point is within `corridor` of the route; without a route everywhere is. One point is
 * no route: FMI wants arrays to start with an element. */
static int is_near_route(const double *route, size_t vertices, const double p[2],
                         double corridor) {
    if (vertices < 2) return 1;
    for (size_t i = 0; i + 1 < vertices; i++)
        if (squared_distance(p, &route[2 * i], &route[2 * i + 2]) <= corridor * corridor) return 1;
    return 0;
}

/* The vertices of the route in the matrix frame. */
static void turn_route(double *turned, const double *route, size_t vertices, const Pose *pose) {
    for (size_t i = 0; i < vertices; i++) {
        double x = route[2 * i] - pose->center[0], y = route[2 * i + 1] - pose->center[1];
        turned[2 * i] = pose->cosine * x + pose->sine * y;
        turned[2 * i + 1] = pose->cosine * y - pose->sine * x;
    }
}

/* ---- integral images ------------------------------------------------------------------------ */

/* Position of (fractional) row and column in the matrix frame, relative to the sensor if `offset`
 * is that of the matrix, else to its centre. */
static void place(const ScanSettings *matrix, double row, double column, double offset,
                  double position[2]) {
    position[0] = (row - matrix->rows / 2.0) * matrix->cell + offset;
    position[1] = (column - matrix->columns / 2.0) * matrix->cell;
}

static double length(const double v[2]) { return sqrt(v[0] * v[0] + v[1] * v[1]); }

static int is_searched(const Zones *zones, const ZoneSettings *settings,
                       const ScanSettings *matrix, size_t vertices, uint32_t row,
                       uint32_t column) {
    double from_sensor[2], center[2];
    place(matrix, row + 0.5, column + 0.5, matrix->offset, from_sensor);
    place(matrix, row + 0.5, column + 0.5, 0.0, center);
    double distance = length(from_sensor);
    return distance >= settings->near_field && distance <= settings->horizon
           && is_near_route(zones->route, vertices, center, settings->corridor);
}

static void integrate(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
                      const Scan *scan, size_t vertices) {
    size_t width = (size_t)matrix->columns + 1;
    memset(zones->points, 0, width * sizeof *zones->points);
    memset(zones->searched, 0, width * sizeof *zones->searched);
    for (uint32_t row = 0; row < matrix->rows; row++) {
        uint64_t points = 0, searched = 0;
        size_t at = (row + 1) * width;
        zones->points[at] = zones->searched[at] = 0;
        for (uint32_t column = 0; column < matrix->columns; column++) {
            points += scan->cells[(size_t)row * matrix->columns + column];
            searched += (uint64_t)is_searched(zones, settings, matrix, vertices, row, column);
            at++;
            zones->points[at] = zones->points[at - width] + points;
            zones->searched[at] = zones->searched[at - width] + searched;
        }
    }
}

/* Sum over the window with its rear right corner at (row, column). */
static uint64_t sum_over(const uint64_t *integral, size_t width, uint32_t row, uint32_t column,
                         uint32_t size) {
    size_t low = row * width + column, high = low + size * width;
    return integral[high + size] - integral[high] - integral[low + size] + integral[low];
}

/* ---- windows -------------------------------------------------------------------------------- */

/* T1 at a distance: T1 (threshold_distance / d)^p, with d at least half a cell. */
static double threshold_at(const ZoneSettings *settings, double distance, double cell) {
    double d = distance > cell / 2 ? distance : cell / 2, threshold = settings->threshold;
    for (uint32_t i = 0; i < settings->threshold_exponent; i++)
        threshold *= settings->threshold_distance / d;
    return threshold;
}

static int collect(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
                   uint32_t size, Problem *problem) {
    size_t width = (size_t)matrix->columns + 1;
    uint64_t cells = (uint64_t)size * size;
    zones->window_count = 0;
    for (uint32_t row = 0; row + size <= matrix->rows; row++)
        for (uint32_t column = 0; column + size <= matrix->columns; column++) {
            if (sum_over(zones->searched, width, row, column, size) < cells) continue;
            double center[2];
            place(matrix, row + size / 2.0, column + size / 2.0, matrix->offset, center);
            Window window = {row, column, size, sum_over(zones->points, width, row, column, size),
                             length(center)};
            double threshold = threshold_at(settings, window.distance, matrix->cell);
            if (!((double)window.points < threshold * (double)cells)) continue;
            if (reserve(&zones->windows, &zones->window_capacity, zones->window_count + 1,
                        sizeof window, problem))
                return 1;
            zones->windows[zones->window_count++] = window;
        }
    return 0;
}

/* Emptiest first, then nearest, then by place, so that the order is total. */
static int by_emptiness(const void *a, const void *b) {
    const Window *x = a, *y = b;
    if (x->points != y->points) return x->points < y->points ? -1 : 1;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    if (x->row != y->row) return x->row < y->row ? -1 : 1;
    return (x->column > y->column) - (x->column < y->column);
}

/* Visit the cells of a window: the number that are covered, and cover all if `cover`. */
static uint64_t covered(Zones *zones, const Window *window, uint32_t columns, int cover) {
    uint64_t count = 0;
    for (uint32_t row = window->row; row < window->row + window->size; row++)
        for (uint32_t column = window->column; column < window->column + window->size; column++) {
            uint8_t *cell = &zones->is_covered[(size_t)row * columns + column];
            count += *cell;
            if (cover) *cell = 1;
        }
    return count;
}

static int accept(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
                  Problem *problem) {
    if (zones->window_count == 0) return 0;
    qsort(zones->windows, zones->window_count, sizeof(Window), by_emptiness);
    for (size_t i = 0; i < zones->window_count; i++) {
        const Window *window = &zones->windows[i];
        double cells = (double)window->size * window->size;
        uint64_t taken = covered(zones, window, matrix->columns, 0);
        if ((double)taken > settings->overlap * cells || (double)taken >= cells) continue;
        covered(zones, window, matrix->columns, 1);
        if (reserve(&zones->zones, &zones->capacity, zones->count + 1, sizeof(Zone), problem))
            return 1;
        Zone zone = {.range = window->size * matrix->cell / 2};
        zone.importance = zone.range / (zone.range + window->distance);
        place(matrix, window->row + window->size / 2.0, window->column + window->size / 2.0, 0.0,
              zone.center);
        zones->zones[zones->count++] = zone;
    }
    return 0;
}

/* Then by place, so that the order is total. */
static int by_importance(const void *a, const void *b) {
    const Zone *x = a, *y = b;
    if (x->importance != y->importance) return x->importance > y->importance ? -1 : 1;
    for (int axis = 0; axis < 2; axis++)
        if (x->center[axis] != y->center[axis]) return x->center[axis] < y->center[axis] ? -1 : 1;
    return 0;
}

static int prepare(Zones *zones, const ScanSettings *matrix, size_t vertices, Problem *problem) {
    size_t cells = (size_t)matrix->rows * matrix->columns;
    size_t corners = ((size_t)matrix->rows + 1) * ((size_t)matrix->columns + 1);
    zones->count = 0;
    if (reserve(&zones->points, &zones->points_capacity, corners, sizeof(uint64_t), problem)
        || reserve(&zones->searched, &zones->searched_capacity, corners, sizeof(uint64_t), problem)
        || reserve(&zones->is_covered, &zones->covered_capacity, cells, 1, problem)
        || reserve(&zones->route, &zones->route_capacity, 2 * vertices, sizeof(double), problem))
        return 1;
    memset(zones->is_covered, 0, cells);
    return 0;
}

int zones_find(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
               const Scan *scan, const double *route, size_t vertices, Problem *problem) {
    if (prepare(zones, matrix, vertices, problem)) return 1;
    turn_route(zones->route, route, vertices, &scan->pose);
    integrate(zones, settings, matrix, scan, vertices);
    uint32_t size = settings->window_smallest;
    while (size <= settings->window_largest / 2) size *= 2;
    for (; size >= settings->window_smallest && size > 0; size /= 2)
        if (collect(zones, settings, matrix, size, problem)
            || accept(zones, settings, matrix, problem))
            return 1;
    if (zones->count) qsort(zones->zones, zones->count, sizeof(Zone), by_importance);
    return 0;
}

void zones_free(Zones *zones) {
    free(zones->zones);
    free(zones->windows);
    free(zones->points);
    free(zones->searched);
    free(zones->is_covered);
    free(zones->route);
}
