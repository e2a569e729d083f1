/* The compressed form of cells that are shares of seen ground, and of their layer; docs/formats.md
 * describes it, fmus/messages/apm/seen_compression.py is the same code in Python. */
#ifndef SEEN_COMPRESSION_H
#define SEEN_COMPRESSION_H
#include "kernel.h"

/* A byte of the code stands for at most so many cells: no decision takes less than
 * log2(65536 / (65536 - 31)) bits. */
enum { SEEN_CELLS_PER_BYTE = 1 << 14 };

typedef struct {
    uint32_t rows, columns, levels; /* levels: 1 to 255 */
} SeenShape;

/* As `compress`; no cell is above the levels. */
size_t compress_seen(uint8_t *out, size_t capacity, const uint8_t *cells, const uint8_t *layer,
                     SeenShape);
/* As `decompress`. */
int decompress_seen(uint8_t *cells, uint8_t *layer, SeenShape, const uint8_t *bytes, size_t size,
                    Problem *);

#endif
