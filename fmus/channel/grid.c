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

static Cells cells_of(const Grid *g, const Box *box) {
    return (Cells){{cell_of(box->low[0], g->low[0], g->cell, g->columns),
                    cell_of(box->low[1], g->low[1], g->cell, g->rows)},
                   {cell_of(box->high[0], g->low[0], g->cell, g->columns),
                    cell_of(box->high[1], g->low[1], g->cell, g->rows)}};
}

/* Choose the cells: about as large as a mean box, and about as many as there are boxes. */
static void lay_out(Grid *g, const Box *box, size_t n) {
    Box all = box[0];
    double extent = 0;
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 2; k++) {
            all.low[k] = fmin(all.low[k], box[i].low[k]);
            all.high[k] = fmax(all.high[k], box[i].high[k]);
        }
        extent += fmax(box[i].high[0] - box[i].low[0], box[i].high[1] - box[i].low[1]);
    }
    double width = all.high[0] - all.low[0], height = all.high[1] - all.low[1];
    double count = (double)n;
    double cell = fmax(fmax(extent / count, sqrt(width * height / count)),
                       fmax(fmax(width, height) / (2 * count), 1.0));
    g->low[0] = all.low[0];
    g->low[1] = all.low[1];
    g->cell = cell;
    g->columns = (uint32_t)(width / cell) + 1;
    g->rows = (uint32_t)(height / cell) + 1;
}

int grid_build(Grid *g, const Box *box, size_t n) {
    g->box = box;
    g->boxes = n;
    g->query = 0;
    g->columns = g->rows = 0;
    if (n == 0) return 0;
    lay_out(g, box, n);
    size_t cells = (size_t)g->columns * g->rows;
    if (BUFFER_RESERVE(g->start, g->start_capacity, cells + 2)) return 1;
    if (BUFFER_RESERVE(g->seen, g->seen_capacity, n)) return 1;
    memset(g->start, 0, (cells + 2) * sizeof *g->start);
    memset(g->seen, 0, n * sizeof *g->seen);
    /* counting sort: count into start[k + 2], then fill while start[k + 1] moves to its end */
    for (size_t i = 0; i < n; i++) {
        Cells c = cells_of(g, &box[i]);
        for (uint32_t y = c.low[1]; y <= c.high[1]; y++)
            for (uint32_t x = c.low[0]; x <= c.high[0]; x++)
                g->start[(size_t)y * g->columns + x + 2]++;
    }
    for (size_t k = 2; k < cells + 2; k++) g->start[k] += g->start[k - 1];
    if (BUFFER_RESERVE(g->item, g->item_capacity, g->start[cells + 1])) return 1;
    for (size_t i = 0; i < n; i++) {
        Cells c = cells_of(g, &box[i]);
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

static size_t visit(Grid *g, size_t cell, Position a, Position b, uint32_t *found, size_t count) {
    for (uint32_t k = g->start[cell]; k < g->start[cell + 1]; k++) {
        uint32_t i = g->item[k];
        if (g->seen[i] == g->query) continue;
        g->seen[i] = g->query;
        if (box_meets_segment(&g->box[i], a, b)) found[count++] = i;
    }
    return count;
}

size_t grid_near_segment(Grid *g, Position a, Position b, uint32_t *found) {
    if (g->boxes == 0) return 0;
    if (++g->query == 0) { /* the counter has wrapped: forget all marks */
        memset(g->seen, 0, g->boxes * sizeof *g->seen);
        g->query = 1;
    }
    /* row by row: the cells over which the segment runs, a little widened against rounding */
    double slack = 1e-6 * g->cell, dx = b.x - a.x, dy = b.y - a.y;
    double bottom = fmin(a.y, b.y), top = fmax(a.y, b.y);
    uint32_t first = cell_of(bottom - slack, g->low[1], g->cell, g->rows);
    uint32_t last = cell_of(top + slack, g->low[1], g->cell, g->rows);
    size_t count = 0;
    for (uint32_t row = first; row <= last; row++) {
        double x0 = a.x, x1 = b.x;
        if (top - bottom > g->cell) {
            /* the outermost rows also stand for what lies beyond the grid */
            double y0 = row == 0 ? bottom : fmax(bottom, g->low[1] + row * g->cell - slack);
            double y1 = row + 1 == g->rows ? top : fmin(top, g->low[1] + (row + 1) * g->cell + slack);
            x0 = a.x + dx * ((y0 - a.y) / dy);
            x1 = a.x + dx * ((y1 - a.y) / dy);
        }
        uint32_t left = cell_of(fmin(x0, x1) - slack, g->low[0], g->cell, g->columns);
        uint32_t right = cell_of(fmax(x0, x1) + slack, g->low[0], g->cell, g->columns);
        for (uint32_t column = left; column <= right; column++)
            count = visit(g, (size_t)row * g->columns + column, a, b, found, count);
    }
    return count;
}
