/* Sorting of whole numbers that carry what is sorted in their lower half. */
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

#endif
