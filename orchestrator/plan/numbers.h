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

/* The exponent of NaN and of infinity has all bits set: ONE more in its lowest place carries to the sign. */
#define DEFINE_ARE_FINITE(name, type, word, EXPONENT, ONE)    \
    static bool name(const type *value, size_t n) {           \
        word carried = 0, bits;                               \
        for (size_t k = 0; k < n; k++) {                      \
            memcpy(&bits, &value[k], sizeof bits);            \
            carried |= (bits & (EXPONENT)) + (ONE);           \
        }                                                     \
        return (carried & ~((EXPONENT) | ((ONE)-1))) == 0;    \
    }
DEFINE_ARE_FINITE(are_finite64, double, uint64_t, 0x7ff0000000000000u, 0x0010000000000000u)
DEFINE_ARE_FINITE(are_finite32, float, uint32_t, 0x7f800000u, 0x00800000u)

#endif
