#include "kernel.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int fail(Problem *problem, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(problem->text, sizeof problem->text, format, arguments);
    va_end(arguments);
    return 1;
}

int reserve(void *array, size_t *capacity, size_t count, size_t size, Problem *problem) {
    if (count <= *capacity) return 0;
    size_t wanted = count > SIZE_MAX / 2 ? count : count + count / 2 + 16;
    void *old, *grown;
    memcpy(&old, array, sizeof old);
    if (wanted > SIZE_MAX / size || !(grown = realloc(old, wanted * size)))
        return fail(problem, "out of memory for %zu elements of %zu bytes", count, size);
    memcpy(array, &grown, sizeof grown);
    *capacity = wanted;
    return 0;
}

/* Taylor series on [-pi/4, pi/4]; the terms left out are below 1e-16. */
static double sine_series(double x) {
    static const double FACTORS[] = {2 * 3, 4 * 5, 6 * 7, 8 * 9, 10 * 11, 12 * 13, 14 * 15};
    double sum = 1.0, square = x * x;
    for (size_t i = sizeof FACTORS / sizeof *FACTORS; i-- > 0;)
        sum = 1.0 - square / FACTORS[i] * sum;
    return x * sum;
}

static double cosine_series(double x) {
    static const double FACTORS[] = {1 * 2, 3 * 4, 5 * 6, 7 * 8, 9 * 10, 11 * 12, 13 * 14, 15 * 16};
    double sum = 1.0, square = x * x;
    for (size_t i = sizeof FACTORS / sizeof *FACTORS; i-- > 0;)
        sum = 1.0 - square / FACTORS[i] * sum;
    return sum;
}

void sine_cosine(double angle, double *sine, double *cosine) {
    /* pi / 2 in two parts; multiples of the first, of 33 bits, are exact up to 2^20 quarters. */
    static const double HIGH = 0x1.921fb544p+0, LOW = 0x1.0b4611a626331p-34;
    double quarters = floor(angle / (HIGH + LOW) + 0.5);
    double rest = angle - quarters * HIGH - quarters * LOW;
    double s = sine_series(rest), c = cosine_series(rest);
    int quadrant = (int)(quarters - 4.0 * floor(quarters / 4.0));
    *sine = (quadrant & 1 ? c : s) * (quadrant >= 2 ? -1.0 : 1.0);
    *cosine = (quadrant & 1 ? s : c) * (quadrant == 1 || quadrant == 2 ? -1.0 : 1.0);
}
