#include "receptions.h"
#include "buffer.h"
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

int receptions_reserve(Receptions *r, size_t more) {
    return BUFFER_RESERVE(r->item, r->capacity, r->count + more);
}

void receptions_free(Receptions *r) {
    free(r->item);
    free(r->scratch);
    *r = (Receptions){0};
}

static bool is_after(const Reception *a, const Reception *b) {
    if (a->time != b->time) return a->time > b->time;
    if (a->packet != b->packet) return a->packet > b->packet;
    if (a->hop != b->hop) return a->hop > b->hop;
    return a->receiver > b->receiver;
}

/* Merge the sorted runs [0, middle) and [middle, n) of `item`. */
static void merge(Reception *item, size_t middle, size_t n, Reception *scratch) {
    if (!is_after(&item[middle - 1], &item[middle])) return;
    memcpy(scratch, item, middle * sizeof *item);
    size_t a = 0, b = middle, to = 0;
    while (a < middle)
        item[to++] = b < n && is_after(&scratch[a], &item[b]) ? item[b++] : scratch[a++];
}

/* Merge sort from the bottom; receptions come almost in order. */
static int sort(Receptions *r) {
    if (BUFFER_RESERVE(r->scratch, r->scratch_capacity, r->count)) return 1;
    for (size_t width = 1; width < r->count; width *= 2)
        for (size_t at = 0; at + width < r->count; at += 2 * width) {
            size_t rest = r->count - at;
            merge(r->item + at, width, rest < 2 * width ? rest : 2 * width, r->scratch);
        }
    return 0;
}

int receptions_release(Receptions *r, int64_t end, Binary *output) {
    if (sort(r)) return 1;
    size_t due = 0;
    while (due < r->count && r->item[due].time <= end) due++;
    if (due > UINT32_MAX) return 1;
    Frame head = {{'R', 'C', 'P', 'T'}, 1, (uint32_t)due, sizeof(Reception)};
    size_t size = sizeof head + due * sizeof(Reception);
    if (binary_reserve(output, size)) return 1;
    memcpy(output->data, &head, sizeof head);
    if (due > 0) memcpy(output->data + sizeof head, r->item, due * sizeof(Reception));
    output->size = size;
    r->count -= due;
    if (r->count > 0) memmove(r->item, r->item + due, r->count * sizeof(Reception));
    return 0;
}
