#include "kernel.h"

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
