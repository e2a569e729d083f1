/* Abstract perception matrices as messages; fmus/messages/apm/ is the same codec in Python. */
#ifndef APM_H
#define APM_H
#include "objects.h"

/* ---- writing */

/* The bytes of a signal that is being written. */
typedef struct {
    uint8_t *data;
    size_t size, capacity;
} Bytes;

/* Space for the mobility-and-height layer while it is made. */
typedef struct {
    uint32_t object, points;
} LayerCell;
typedef struct {
    LayerCell *cells;
    size_t capacity;
} Layer;

/* Append the matrix of `scan` as one entry of an "APMS" signal, with the layer of `objects` unless
 * that is NULL. */
int apm_append(Bytes *, Layer *, const ScanSettings *, const Sensor *, const Scan *,
               const Objects *, Problem *);
/* Put the entry that begins at `start` and is the last one into the compressed form, unless that is
 * not shorter. */
int apm_compress(Bytes *, size_t start, Problem *);

/* ---- reading */

/* A message; `cells` are little-endian uint32 at any address, `layer` their ApmLayerCell or
 * NULL. */
typedef struct {
    ApmHeader header;
    const uint8_t *cells, *layer;
} Apm;

/* What became of a message that was to be read. */
typedef enum { DECODED, MALFORMED, OUT_OF_MEMORY } Decoding;

/* Read and check one message. The result uses the message and, where that is compressed, `space`.
 * Room is made there for what the message can mean only: CELLS_PER_BYTE cells of 8 bytes for each
 * of its bytes (SEEN_CELLS_PER_BYTE with levels), and APM_MOST_CELLS in all. */
Decoding apm_decode(Apm *, Bytes *space, const uint8_t *message, size_t size, Problem *);
/* The abstract perception index of cell number `cell`, row by row. */
uint32_t apm_index(const Apm *, size_t cell);

/* The messages of an "APMS" signal, one after the other. */
typedef struct {
    const uint8_t *next;
    uint32_t count; /* messages left */
} Messages;

/* Check the frame down to the borders of all messages. No bytes are no messages. */
int messages_open(Messages *, const uint8_t *signal, size_t size, Problem *);
/* Go to the next message; 0 after the last. */
int messages_next(Messages *, const uint8_t **message, size_t *size);

#endif
