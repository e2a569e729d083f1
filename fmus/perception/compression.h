/* The compressed form of cells that count points, and of their layer; docs/formats.md describes it,
 * fmus/messages/apm/compression.py is the same code in Python. */
#ifndef COMPRESSION_H
#define COMPRESSION_H
#include "kernel.h"

/* A byte of a compressed matrix stands for at most so many cells. */
enum { CELLS_PER_BYTE = 32 };

/* Write `count` cells (little-endian uint32 at any address) and their layer (ApmLayerCell each,
 * NULL if there is none) to `out`. Returns the number of bytes; 0 if more than `capacity` are
 * needed, or if the layer says something about a cell without points. */
size_t compress(uint8_t *out, size_t capacity, const uint8_t *cells, const uint8_t *layer,
                size_t count);
/* The inverse: all of the `size` bytes must make exactly `count` cells and, unless `layer` is NULL,
 * their layer. */
int decompress(uint8_t *cells, uint8_t *layer, size_t count, const uint8_t *bytes, size_t size,
               Problem *);

#endif
