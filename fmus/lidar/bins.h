/* Which faces each azimuth may hit: lists of faces by azimuth bin. */
#ifndef BINS_H
#define BINS_H
#include <stddef.h>
#include <stdint.h>

/* Consecutive bins, counted modulo the number of bins. */
typedef struct {
    uint32_t first, count;
} Window;

/* Bin b holds item[start[b]] ... item[start[b + 1] - 1], ascending face numbers. */
typedef struct {
    uint32_t *start, *item;
    size_t start_capacity, item_capacity;
} Bins;

/* The bins of a turn divided into `bins` that the angles [low, high] touch, with a margin of a
 * millionth of a bin; low [rad] is between -2 pi and 2 pi. */
Window window_over(double low, double high, uint32_t bins);

/* Sort faces 0..count-1 into bins. An all-zero Bins is valid. Returns nonzero if memory is short.
 */
int bins_fill(Bins *, const Window *window, size_t count, uint32_t bins);
void bins_clear(Bins *);

#endif
