/* Copies and checks of numbers. */
#ifndef NUMBERS_H
#define NUMBERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* A value that others may see. */
typedef struct {
    const uint8_t *const *base; /* where the outputs of its component lie now */
    size_t offset;              /* of the value behind that [byte] */
    const uint64_t *version;    /* counts publications */
} Source;

static inline const void *seen_at(const Source *s) { return *s->base + s->offset; }

/* Scalars without the call of a function. */
static inline void copy(void *to, const void *from, size_t size) {
    switch (size) {
    case 8: memcpy(to, from, 8); break;
    case 4: memcpy(to, from, 4); break;
    case 1: memcpy(to, from, 1); break;
    default: memcpy(to, from, size);
    }
}

/* Out of the way of what is called at every step, which is to stay in the first cache. */
#define APART __attribute__((noinline))

/* Booleans of an FMU, of one or four bytes each, and of signals. */
#define DEFINE_TRUTHS(name, type)                                                     \
    APART static void name(uint8_t *to, const type *from, size_t n) {                 \
        for (size_t k = 0; k < n; k++) to[k] = from[k] != 0;                          \
    }
DEFINE_TRUTHS(truths8, uint8_t)
DEFINE_TRUTHS(truths32, int32_t)
APART static void widen_truths(int32_t *to, const uint8_t *from, size_t n) {
    for (size_t k = 0; k < n; k++) to[k] = from[k];
}

/* Zero times a number is zero, and times infinity or NaN it is NaN, which stays in a sum; of many numbers there are
 * eight sums, side by side, and what comes 2 KB later is asked for: large values are no longer in the first caches. */
#define DEFINE_ARE_FINITE(name, type)                                      \
    APART static type name##_sum(const type *value, size_t n) {            \
        enum { LANES = 8, AHEAD = 2048 };                                  \
        type sum[LANES] = {0}, total = 0;                                  \
        size_t k = 0;                                                      \
        for (; k + LANES <= n; k += LANES) {                               \
            __builtin_prefetch(value + k + AHEAD / sizeof(type));          \
            for (size_t i = 0; i < LANES; i++) sum[i] += value[k + i] * 0; \
        }                                                                  \
        for (; k < n; k++) total += value[k] * 0;                          \
        for (size_t i = 0; i < LANES; i++) total += sum[i];                \
        return total;                                                      \
    }                                                                      \
    static inline bool name(const type *value, size_t n) {                 \
        return (n == 1 ? *value * 0 : name##_sum(value, n)) == 0;          \
    }
DEFINE_ARE_FINITE(are_finite64, double)
DEFINE_ARE_FINITE(are_finite32, float)

#endif
