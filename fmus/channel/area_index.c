#include "area_index.h"
#include "buffer.h"
#include "sort.h"
#include <string.h>

enum { BLOCK = 16 };

/* ---- building ---- */

static int columns_reserve(AreaColumns *c, size_t n) {
    return BUFFER_RESERVE(c->x, c->x_capacity, n) || BUFFER_RESERVE(c->y, c->y_capacity, n)
        || BUFFER_RESERVE(c->half_x, c->half_x_capacity, n)
        || BUFFER_RESERVE(c->half_y, c->half_y_capacity, n);
}

static void columns_free(AreaColumns *c) {
    free(c->x);
    free(c->y);
    free(c->half_x);
    free(c->half_y);
}

static void put(AreaColumns *c, size_t at, const AreaIndex *s, const Area *area) {
    c->x[at] = (float)(area->center[0] - s->origin[0]);
    c->y[at] = (float)(area->center[1] - s->origin[1]);
    c->half_x[at] = (float)area->half[0];
    c->half_y[at] = (float)area->half[1];
}

static void fill_up(AreaColumns *c, size_t from, size_t to) {
    for (size_t at = from; at < to; at++) {
        c->x[at] = c->y[at] = 0;
        c->half_x[at] = c->half_y[at] = -1e30f;
    }
}

static size_t in_blocks(size_t n) { return (n + BLOCK - 1) / BLOCK * BLOCK; }

/* The area around those at the places `from` to `to`. */
static Area around(const AreaIndex *s, const Area *area, size_t from, size_t to) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t at = from; at < to; at++)
        for (int k = 0; k < 2; k++) {
            const Area *a = &area[s->item[at]];
            low[k] = smaller(low[k], a->center[k] - a->half[k]);
            high[k] = larger(high[k], a->center[k] + a->half[k]);
        }
    return area_between(low, high);
}

static void sort_along(uint64_t *key, uint64_t *scratch, size_t n, const Area *area, int axis) {
    for (size_t k = 0; k < n; k++) {
        uint32_t index = (uint32_t)key[k];
        key[k] = sort_key((float)area[index].center[axis], index);
    }
    sort_keys(key, scratch, n);
}

/* Put areas that lie together into the same block: in strips by x, in each strip by y
 * (S. T. Leutenegger, M. A. Lopez, J. Edgington, "STR: a simple and efficient algorithm for R-tree
 * packing", ICDE 1997). */
static void arrange(AreaIndex *s, const Area *area, size_t n) {
    for (size_t k = 0; k < n; k++) s->key[k] = k;
    sort_along(s->key, s->key + n, n, area, 0);
    size_t strips = (size_t)ceil(sqrt((double)in_blocks(n) / BLOCK));
    size_t strip = in_blocks((n + strips - 1) / strips);
    for (size_t from = 0; from < n; from += strip)
        sort_along(s->key + from, s->key + n, n - from < strip ? n - from : strip, area, 1);
    for (size_t k = 0; k < n; k++) s->item[k] = (uint32_t)s->key[k];
}

int area_index_build(AreaIndex *s, const Area *area, size_t n) {
    size_t places = in_blocks(n);
    s->blocks = places / BLOCK;
    if (n == 0) return 0;
    if (columns_reserve(&s->area, places) || columns_reserve(&s->block, in_blocks(s->blocks))
        || BUFFER_RESERVE(s->item, s->item_capacity, n)
        || BUFFER_RESERVE(s->key, s->key_capacity, 2 * n))
        return 1;
    arrange(s, area, n);
    Area all = around(s, area, 0, n);
    s->extent = all.half[0] + all.half[1];
    for (int k = 0; k < 2; k++) s->origin[k] = all.center[k];
    for (size_t at = 0; at < n; at++) put(&s->area, at, s, &area[s->item[at]]);
    fill_up(&s->area, n, places);
    for (size_t block = 0; block < s->blocks; block++) {
        size_t from = block * BLOCK, to = from + BLOCK < n ? from + BLOCK : n;
        Area area_of_block = around(s, area, from, to);
        put(&s->block, block, s, &area_of_block);
    }
    fill_up(&s->block, s->blocks, in_blocks(s->blocks));
    return 0;
}

void area_index_free(AreaIndex *s) {
    columns_free(&s->area);
    columns_free(&s->block);
    free(s->item);
    free(s->key);
    *s = (AreaIndex){0};
}

/* ---- looking ---- */

/* A corridor in single precision, relative to the origin. */
typedef struct { float x, y, step_x, step_y, margin_x, margin_y; } Way;

static Way way_of(const AreaIndex *s, Position a, Position b, const double margin[2]) {
    Corridor c = corridor(a, b, margin);
    double x = c.middle[0] - s->origin[0], y = c.middle[1] - s->origin[1];
    /* 30 times the rounding of any coordinate, of which the test below has a few */
    double slack = 2e-6 * (fabs(x) + fabs(y) + fabs(c.half[0]) + fabs(c.half[1]) + s->extent);
    return (Way){(float)x, (float)y, (float)c.half[0], (float)c.half[1],
                 (float)(c.margin[0] + slack), (float)(c.margin[1] + slack)};
}

/* Which areas of a block meet the corridor, by the axes that can separate a segment from a
 * rectangle; a bit for each. */
static uint32_t meeting(const AreaColumns *c, size_t from, const Way *w) {
    const float *x = c->x + from, *y = c->y + from, *half_x = c->half_x + from,
                *half_y = c->half_y + from;
    float long_x = fabsf(w->step_x), long_y = fabsf(w->step_y);
    uint32_t apart[BLOCK], bits = 0;
    for (int k = 0; k < BLOCK; k++) {
        float dx = x[k] - w->x, dy = y[k] - w->y;
        float wide = half_x[k] + w->margin_x, high = half_y[k] + w->margin_y;
        float across = fabsf(w->step_x * dy - w->step_y * dx);
        apart[k] = (fabsf(dx) > wide + long_x) | (fabsf(dy) > high + long_y)
            | (across > wide * long_y + high * long_x);
    }
    for (int k = 0; k < BLOCK; k++) bits |= (apart[k] ^ 1) << k;
    return bits;
}

static int lowest_bit(uint32_t bits) {
#if defined(__GNUC__)
    return __builtin_ctz(bits);
#else
    int k = 0;
    while (!(bits & 1)) bits >>= 1, k++;
    return k;
#endif
}

size_t area_index_near(const AreaIndex *s, Position a, Position b, const double margin[2],
                       uint32_t *found) {
    if (s->blocks == 0) return 0;
    Way way = way_of(s, a, b, margin);
    size_t count = 0;
    for (size_t from = 0; from < s->blocks; from += BLOCK)
        for (uint32_t near = meeting(&s->block, from, &way); near; near &= near - 1) {
            size_t block = (from + (size_t)lowest_bit(near)) * BLOCK;
            for (uint32_t bits = meeting(&s->area, block, &way); bits; bits &= bits - 1)
                found[count++] = s->item[block + (size_t)lowest_bit(bits)];
        }
    return count;
}
