#include "bins.h"

#include <math.h>
#include <string.h>

#include "memory.h"
#include "portable_math.h"

static const double MARGIN = 1e-6;

Window window_over(double low, double high, uint32_t bins) {
    double scale = bins / (2.0 * PI);
    double first = floor(low * scale - MARGIN), last = floor(high * scale + MARGIN);
    if (last - first + 1.0 >= bins)
        return (Window){0, bins};
    int64_t wrapped = (int64_t)first % bins;
    return (Window){(uint32_t)(wrapped < 0 ? wrapped + bins : wrapped),
                    (uint32_t)(last - first + 1.0)};
}

/* Add `value` to the counters of all bins of a window. */
static void add(uint32_t *counter, Window window, uint32_t bins, uint32_t value) {
    uint32_t b = window.first;
    for (uint32_t i = 0; i < window.count; i++) {
        counter[b] += value;
        b = b + 1 < bins ? b + 1 : 0;
    }
}

int bins_fill(Bins *lists, const Window *window, size_t count, uint32_t bins) {
    int short_of_memory = 0;
    uint64_t total = 0;
    for (size_t i = 0; i < count; i++)
        total += window[i].count;
    if (total > UINT32_MAX || count > UINT32_MAX)
        return 1;
    lists->start = with_room(lists->start, &lists->start_capacity, (size_t)bins + 1,
                             sizeof *lists->start, &short_of_memory);
    lists->item = with_room(lists->item, &lists->item_capacity, (size_t)total,
                            sizeof *lists->item, &short_of_memory);
    if (short_of_memory)
        return 1;
    memset(lists->start, 0, ((size_t)bins + 1) * sizeof *lists->start);
    for (size_t i = 0; i < count; i++)
        add(lists->start, window[i], bins, 1);
    /* start[b] becomes the end of bin b, and its beginning while the bin is filled backwards */
    for (uint32_t b = 1; b <= bins; b++)
        lists->start[b] += lists->start[b - 1];
    for (size_t i = count; i-- > 0;) {
        uint32_t b = window[i].first;
        for (uint32_t n = 0; n < window[i].count; n++) {
            lists->item[--lists->start[b]] = (uint32_t)i;
            b = b + 1 < bins ? b + 1 : 0;
        }
    }
    return 0;
}

void bins_clear(Bins *lists) {
    free(lists->start);
    free(lists->item);
    memset(lists, 0, sizeof *lists);
}
