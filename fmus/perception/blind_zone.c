#include "blind_zone.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- integral images ------------------------------------------------------------------------ */

/* Position of (fractional) row and column in the matrix frame, relative to the sensor if `offset`
 * is that of the matrix, else to its centre. */
static void place(const ScanSettings *matrix, double row, double column, double offset,
                  double position[2]) {
    position[0] = (row - matrix->rows / 2.0) * matrix->cell + offset;
    position[1] = (column - matrix->columns / 2.0) * matrix->cell;
}

static double length(const double v[2]) { return sqrt(v[0] * v[0] + v[1] * v[1]); }

/* Each sub-cell in the region has the index of its cell: the mean over a window is that over the
 * area that matters. */
static void integrate(Zones *zones, const ScanSettings *matrix, const Scan *scan,
                      const Region *region) {
    size_t width = (size_t)matrix->columns + 1;
    memset(zones->points, 0, width * sizeof *zones->points);
    memset(zones->inside, 0, width * sizeof *zones->inside);
    for (uint32_t row = 0; row < matrix->rows; row++) {
        uint64_t points = 0, inside = 0;
        size_t at = (row + 1) * width, cell = (size_t)row * matrix->columns;
        zones->points[at] = zones->inside[at] = 0;
        for (uint32_t column = 0; column < matrix->columns; column++, cell++) {
            points += (uint64_t)scan->cells[cell] * region->inside[cell];
            inside += region->inside[cell];
            at++;
            zones->points[at] = zones->points[at - width] + points;
            zones->inside[at] = zones->inside[at - width] + inside;
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
static double threshold_at(const ZoneSettings *settings, const ScanSettings *matrix,
                           double distance) {
    double d = distance > matrix->cell / 2 ? distance : matrix->cell / 2;
    double threshold = settings->threshold * (matrix->levels ? matrix->levels : 1);
    for (uint32_t i = 0; i < settings->threshold_exponent; i++)
        threshold *= settings->threshold_distance / d;
    return threshold;
}

static int collect(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
                   const Region *region, uint32_t size, Problem *problem) {
    size_t width = (size_t)matrix->columns + 1;
    double least = settings->region_share * size * size * region->side * region->side;
    zones->window_count = 0;
    for (uint32_t row = 0; row + size <= matrix->rows; row++)
        for (uint32_t column = 0; column + size <= matrix->columns; column++) {
            uint64_t inside = sum_over(zones->inside, width, row, column, size);
            if (inside == 0 || (double)inside < least) continue;
            double center[2];
            place(matrix, row + size / 2.0, column + size / 2.0, matrix->offset, center);
            double points = (double)sum_over(zones->points, width, row, column, size);
            Window window = {row, column, size, inside, points / (double)inside, length(center)};
            if (!(window.index < threshold_at(settings, matrix, window.distance))) continue;
            if (reserve(&zones->windows, &zones->window_capacity, zones->window_count + 1,
                        sizeof window, problem))
                return 1;
            zones->windows[zones->window_count++] = window;
        }
    return 0;
}

/* Emptiest first, then those with the most that matters, then nearest, then by place, so that the
 * order is total. */
static int by_emptiness(const void *a, const void *b) {
    const Window *x = a, *y = b;
    if (x->index != y->index) return x->index < y->index ? -1 : 1;
    if (x->inside != y->inside) return x->inside > y->inside ? -1 : 1;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    if (x->row != y->row) return x->row < y->row ? -1 : 1;
    return (x->column > y->column) - (x->column < y->column);
}

/* Whether an accepted window, which is at least as large, reaches into a window: then it covers one
 * of the cells in its corners. */
static int is_touched(const Zones *zones, const Window *window, uint32_t columns) {
    uint32_t rows[2] = {window->row, window->row + window->size - 1};
    uint32_t sides[2] = {window->column, window->column + window->size - 1};
    for (int corner = 0; corner < 4; corner++)
        if (zones->is_covered[(size_t)rows[corner / 2] * columns + sides[corner % 2]]) return 1;
    return 0;
}

/* Whether accepted windows cover more than a share of a window, or all of it that is searched. */
static int is_taken(const Zones *zones, const Window *window, const Region *region,
                    uint32_t columns, double share) {
    uint64_t cells = 0, inside = 0;
    if (!is_touched(zones, window, columns)) return 0;
    if (share == 0.0) return 1;
    for (uint32_t row = window->row; row < window->row + window->size; row++)
        for (uint32_t column = window->column; column < window->column + window->size; column++) {
            size_t cell = (size_t)row * columns + column;
            if (!zones->is_covered[cell]) continue;
            cells++;
            inside += region->inside[cell];
        }
    return (double)cells > share * window->size * window->size || inside == window->inside;
}

static void cover(Zones *zones, const Window *window, uint32_t columns) {
    for (uint32_t row = window->row; row < window->row + window->size; row++)
        memset(&zones->is_covered[(size_t)row * columns + window->column], 1, window->size);
}

static int accept(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
                  const Region *region, Problem *problem) {
    if (zones->window_count == 0) return 0;
    qsort(zones->windows, zones->window_count, sizeof(Window), by_emptiness);
    for (size_t i = 0; i < zones->window_count; i++) {
        const Window *window = &zones->windows[i];
        if (is_taken(zones, window, region, matrix->columns, settings->overlap)) continue;
        cover(zones, window, matrix->columns);
        if (reserve(&zones->zones, &zones->capacity, zones->count + 1, sizeof(Zone), problem))
            return 1;
        Zone zone = {.range = window->size * matrix->cell / 2, .row = window->row,
                     .column = window->column, .size = window->size};
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

static int prepare(Zones *zones, const ScanSettings *matrix, Problem *problem) {
    size_t cells = (size_t)matrix->rows * matrix->columns;
    size_t corners = ((size_t)matrix->rows + 1) * ((size_t)matrix->columns + 1);
    zones->count = 0;
    if (reserve(&zones->points, &zones->points_capacity, corners, sizeof(uint64_t), problem)
        || reserve(&zones->inside, &zones->inside_capacity, corners, sizeof(uint64_t), problem)
        || reserve(&zones->is_covered, &zones->covered_capacity, cells, 1, problem))
        return 1;
    memset(zones->is_covered, 0, cells);
    return 0;
}

int zones_find(Zones *zones, const ZoneSettings *settings, const ScanSettings *matrix,
               const Scan *scan, const Region *region, Problem *problem) {
    if (prepare(zones, matrix, problem)) return 1;
    integrate(zones, matrix, scan, region);
    uint32_t size = settings->window_smallest;
    while (size <= settings->window_largest / 2) size *= 2;
    for (; size >= settings->window_smallest && size > 0; size /= 2)
        if (collect(zones, settings, matrix, region, size, problem)
            || accept(zones, settings, matrix, region, problem))
            return 1;
    if (zones->count) qsort(zones->zones, zones->count, sizeof(Zone), by_importance);
    return 0;
}

void zones_free(Zones *zones) {
    free(zones->zones);
    free(zones->windows);
    free(zones->points);
    free(zones->inside);
    free(zones->is_covered);
}
