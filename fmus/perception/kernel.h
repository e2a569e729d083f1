/* What every part of the perception unit shares: faults, growable arrays, portable trigonometry. */
#ifndef KERNEL_H
#define KERNEL_H
#include <stddef.h>
#include <stdint.h>

/* A fused multiply-add rounds once where others round twice: recordings of one scenario would
 * differ between machines. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

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

/* Largest argument of sine_cosine [rad]; beyond, an angle says nothing about a direction. */
#define ANGLE_LIMIT 1e6

/* Sine and cosine of `angle` [rad], the same bits on every machine (those of C libraries differ in
 * the last one); error below 2e-16 for small angles and 1e-10 at ANGLE_LIMIT. */
void sine_cosine(double angle, double *sine, double *cosine);

#endif
