#include "grid.h"
#include "buffer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct { uint32_t low[2], high[2]; } Cells;

/* Column or row of a coordinate, clamped into the grid (also when it is far outside). */
static uint32_t cell_of(double coordinate, double low, double cell, uint32_t count) {
    double k = floor((coordinate - low) / cell);
    if (!(k > 0)) return 0;
    return k >= count ? count - 1 : (uint32_t)k;
}

static Cells cells_of(const Grid *g, const Area *area) {
    Cells cells;
    uint32_t count[2] = {g->columns, g->rows};
    for (int k = 0; k < 2; k++) {
        cells.low[k] = cell_of(area->center[k] - area->half[k], g->low[k], g->cell, count[k]);
        cells.high[k] = cell_of(area->center[k] + area->half[k], g->low[k], g->cell, count[k]);
    }
    return cells;
}

/* Choose the cells: about as large as a mean area, and about as many as there are areas. */
static void lay_out(Grid *g, const Area *area, size_t n) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, extent = 0;
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 2; k++) {
            low[k] = smaller(low[k], area[i].center[k] - area[i].half[k]);
            high[k] = larger(high[k], area[i].center[k] + area[i].half[k]);
        }
        extent += 2 * larger(area[i].half[0], area[i].half[1]);
    }
    double width = high[0] - low[0], height = high[1] - low[1], count = (double)n;
    double cell = larger(larger(extent / count, sqrt(width * height / count)),
                         larger(larger(width, height) / (2 * count), 1.0));
    g->low[0] = low[0];
    g->low[1] = low[1];
    g->cell = cell;
    g->columns = (uint32_t)(width / cell) + 1;
    g->rows = (uint32_t)(height / cell) + 1;
}

int grid_build(Grid *g, const Area *area, size_t n) {
    g->area = area;
    g->areas = n;
    g->query = 0;
    g->columns = g->rows = 0;
    if (n == 0) return 0;
    lay_out(g, area, n);
    size_t cells = (size_t)g->columns * g->rows;
    if (BUFFER_RESERVE(g->start, g->start_capacity, cells + 2)) return 1;
    if (BUFFER_RESERVE(g->seen, g->seen_capacity, n)) return 1;
    memset(g->start, 0, (cells + 2) * sizeof *g->start);
    memset(g->seen, 0, n * sizeof *g->seen);
    /* counting sort: count into start[k + 2], then fill while start[k + 1] moves to its end */
    for (size_t i = 0; i < n; i++) {
        Cells c = cells_of(g, &area[i]);
        for (uint32_t y = c.low[1]; y <= c.high[1]; y++)
            for (uint32_t x = c.low[0]; x <= c.high[0]; x++)
                g->start[(size_t)y * g->columns + x + 2]++;
    }
    for (size_t k = 2; k < cells + 2; k++) g->start[k] += g->start[k - 1];
    if (BUFFER_RESERVE(g->item, g->item_capacity, g->start[cells + 1])) return 1;
    for (size_t i = 0; i < n; i++) {
        Cells c = cells_of(g, &area[i]);
        for (uint32_t y = c.low[1]; y <= c.high[1]; y++)
            for (uint32_t x = c.low[0]; x <= c.high[0]; x++)
                g->item[g->start[(size_t)y * g->columns + x + 1]++] = (uint32_t)i;
    }
    return 0;
}

void grid_free(Grid *g) {
    free(g->start);
    free(g->item);
    free(g->seen);
    *g = (Grid){0};
}

static size_t visit(Grid *g, size_t cell, const Corridor *c, uint32_t *found, size_t count) {
    for (uint32_t k = g->start[cell]; k < g->start[cell + 1]; k++) {
        uint32_t i = g->item[k];
        if (g->seen[i] == g->query) continue;
        g->seen[i] = g->query;
        if (area_meets(&g->area[i], c)) found[count++] = i;
    }
    return count;
}

size_t grid_near_segment(Grid *g, Position a, Position b, const double margin[2], uint32_t *found) {
    if (g->areas == 0) return 0;
    if (++g->query == 0) { /* the counter has wrapped: forget all marks */
        memset(g->seen, 0, g->areas * sizeof *g->seen);
        g->query = 1;
    }
    Corridor way = corridor(a, b, margin);
    /* row by row: the cells over which the corridor runs, a little widened against rounding */
    double x_margin = margin[0] + 1e-6 * g->cell, y_margin = margin[1] + 1e-6 * g->cell;
    double bottom = smaller(a.y, b.y), top = larger(a.y, b.y);
    bool is_steep = top - bottom > g->cell;
    double slope = is_steep ? (b.x - a.x) / (b.y - a.y) : 0;
    uint32_t first = cell_of(bottom - y_margin, g->low[1], g->cell, g->rows);
    uint32_t last = cell_of(top + y_margin, g->low[1], g->cell, g->rows);
    size_t count = 0;
    for (uint32_t row = first; row <= last; row++) {
        double x0 = a.x, x1 = b.x;
        if (is_steep) {
            /* the outermost rows also stand for what lies beyond the grid */
            double low = g->low[1] + row * g->cell - y_margin;
            double high = g->low[1] + (row + 1) * g->cell + y_margin;
            x0 = a.x + slope * ((row == 0 ? bottom : smaller(larger(bottom, low), top)) - a.y);
            x1 = a.x + slope * ((row + 1 == g->rows ? top : larger(smaller(top, high), bottom)) - a.y);
        }
        uint32_t left = cell_of(smaller(x0, x1) - x_margin, g->low[0], g->cell, g->columns);
        uint32_t right = cell_of(larger(x0, x1) + x_margin, g->low[0], g->cell, g->columns);
        for (uint32_t column = left; column <= right; column++)
            count = visit(g, (size_t)row * g->columns + column, &way, found, count);
    }
    return count;
}
