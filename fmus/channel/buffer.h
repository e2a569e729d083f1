/* Arrays that grow and never shrink, so that steps do not allocate once the scene has its size. */
#ifndef BUFFER_H
#define BUFFER_H
#include <stddef.h>
#include <stdlib.h>

/* `data` with room for `count` elements and `*capacity` adapted, or both unchanged if memory is
 * short. */
static inline void *buffer_grow(void *data, size_t *capacity, size_t count, size_t size) {
    if (count <= *capacity) return data;
    size_t wanted = count + count / 2 + 8;
    if (wanted < count || wanted > (size_t)-1 / size) return data;
    void *grown = realloc(data, wanted * size);
    if (!grown) return data;
    *capacity = wanted;
    return grown;
}

/* Make room for `count` elements in the array `data`; nonzero if memory is short. */
#define BUFFER_RESERVE(data, capacity, count) \
    ((data) = buffer_grow((data), &(capacity), (count), sizeof *(data)), (count) > (capacity))

#endif
