/* What every part of the perception unit shares: faults, growable arrays, portable trigonometry. */
#ifndef KERNEL_H
#define KERNEL_H
#include "portable_math.h"

#include <stddef.h>
#include <stdint.h>

/* What is wrong, as a sentence for the person who can fix it. */
typedef struct {
    char text[256];
} Problem;

/* Describe a problem. Returns 1, which functions of this unit return when they fail. */
int fail(Problem *, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;

/* Make room in `*array` (a pointer to any object type, passed as void *) for `count` elements of
 * `size` bytes; contents are kept. Fails if memory is short; the array is as before then. */
int reserve(void *array, size_t *capacity, size_t count, size_t size, Problem *);

/* Largest time stamp of a scan [ns], 146 years; differences of such times do not overflow. */
#define TIME_LIMIT ((int64_t)1 << 62)

#endif
