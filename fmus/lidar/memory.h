/* Growable arrays. */
#ifndef MEMORY_H
#define MEMORY_H
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/* `array` with room for `count` elements of `size` bytes, contents kept and `*capacity` updated. If
 * memory is short, `*short_of_memory` becomes 1 and the array stays as it was. */
static inline void *with_room(void *array, size_t *capacity, size_t count, size_t size,
                              int *short_of_memory) {
    if (count <= *capacity)
        return array;
    size_t room = *capacity < SIZE_MAX / 2 && count < 2 * *capacity ? 2 * *capacity : count;
    void *grown = room <= SIZE_MAX / size ? realloc(array, room * size) : NULL;
    if (grown == NULL) {
        *short_of_memory = 1;
        return array;
    }
    *capacity = room;
    return grown;
}

#endif
