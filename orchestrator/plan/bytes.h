/* Values of type Binary and String. */
#ifndef BYTES_H
#define BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "numbers.h"

/* A value of type Binary or String; `data` is ours, and ends with a zero that does not count. */
typedef struct {
    uint8_t *data;
    size_t size, capacity;
} Bytes;

static int bytes_reserve(Bytes *b, size_t size) {
    if (size <= b->capacity) return 0;
    size_t wanted = size + size / 2 + 64;
    uint8_t *grown = realloc(b->data, wanted);
    if (!grown) return 1;
    b->data = grown;
    b->capacity = wanted;
    return 0;
}

APART static int bytes_assign(Bytes *b, const uint8_t *data, size_t size) {
    if (bytes_reserve(b, size + 1)) return 1;
    if (size > 0) memcpy(b->data, data, size);
    b->data[size] = 0;
    b->size = size;
    return 0;
}

APART static int bytes_append(Bytes *b, const uint8_t *data, size_t size) {
    if (bytes_reserve(b, b->size + size)) return 1;
    if (size > 0) memcpy(b->data + b->size, data, size);
    b->size += size;
    return 0;
}

/* Whether a text is one (RFC 3629, section 4). */
static bool is_utf8(const uint8_t *text, size_t size) {
    for (size_t k = 0; k < size;) {
        uint8_t first = text[k++];
        if (first < 0x80) continue;
        size_t more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : 1;
        uint8_t low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
        uint8_t high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
        if (first < 0xc2 || first > 0xf4 || more > size - k) return false;
        for (; more > 0; more--, low = 0x80, high = 0xbf)
            if (text[k] < low || text[k++] > high) return false;
    }
    return true;
}

#endif
