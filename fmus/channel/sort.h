/* Sorting: of whole numbers that carry what is sorted in their lower half, and of short lists. */
#ifndef SORT_H
#define SORT_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* A number that sorts by `coordinate`, finite, and then by `index`, which is its lower half. */
static inline uint64_t sort_key(float coordinate, uint32_t index) {
    uint32_t bits;
    coordinate += 0.0f; /* no negative zero */
    memcpy(&bits, &coordinate, sizeof bits);
    bits ^= bits >> 31 ? UINT32_MAX : UINT32_C(1) << 31;
    return (uint64_t)bits << 32 | index;
}

/* Sort ascending; `scratch` has room for `n` numbers. */
void sort_keys(uint64_t *key, uint64_t *scratch, size_t n);

/* Define `static void NAME(TYPE *item, size_t n)`, an insertion sort, for items that are few or
 * all but in order: by `bool IS_BEFORE(const TYPE *, const TYPE *)`; equal ones stay in order. */
#define DEFINE_INSERTION_SORT(NAME, TYPE, IS_BEFORE)                                     \
    static void NAME(TYPE *item, size_t n) {                                             \
        for (size_t i = 1; i < n; i++) {                                                 \
            if (!IS_BEFORE(&item[i], &item[i - 1])) continue;                            \
            TYPE moved = item[i];                                                        \
            size_t k = i;                                                                \
            for (; k > 0 && IS_BEFORE(&moved, &item[k - 1]); k--) item[k] = item[k - 1]; \
            item[k] = moved;                                                             \
        }                                                                                \
    }

#endif
