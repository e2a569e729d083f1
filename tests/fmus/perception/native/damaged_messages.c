/* Compressed messages, most of them damaged or pure noise.
 *
 *     damaged_messages N        decodes N of them
 *     damaged_messages starved  an instance sends and receives compressed messages, again and
 *                               again, each time with the next allocation failing
 *     damaged_messages starved seen_area  the same with shares of seen ground
 *
 * Nothing may crash, read or write beyond its bytes, or leak; what is decoded must survive another
 * compression. */
#include "apm.h"
#include "compression.h"
#include "seen_compression.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "starving.h"
#include "variables.h"

static uint32_t any(uint32_t below) { /* a linear congruential generator */
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(((state >> 32) * below) >> 32);
}

/* ---- messages ------------------------------------------------------------------------------- */

enum { SIDE = 12, CELLS = SIDE * SIDE, PAYLOAD = 10 * CELLS }; /* the most of each */

typedef struct {
    ApmHeader header;
    uint8_t payload[PAYLOAD];
} Message;

/* Write cells and layer in the form of their header; returns their size, or 0. */
static size_t write_payload(uint8_t *out, size_t capacity, const ApmHeader *header,
                            const uint8_t *cells, const uint8_t *layer) {
    const uint32_t levels = header->flags >> APM_LEVELS_SHIFT;
    const SeenShape shape = {header->rows, header->columns, levels};
    if (levels) return compress_seen(out, capacity, cells, layer, shape);
    return compress(out, capacity, cells, layer, (size_t)header->rows * header->columns);
}

/* A sound message; returns the size of its payload. */
static size_t make(Message *message) {
    const uint16_t rows = (uint16_t)(1 + any(SIDE)), columns = (uint16_t)(1 + any(SIDE));
    const uint32_t levels = any(2) ? 0 : any(3) ? 1 + any(4) : 1 + any(255);
    message->header = (ApmHeader){.magic = {'A', 'P', 'M', 'M'}, .version = 1, .cell = 5,
                                  .flags = (uint16_t)(levels << APM_LEVELS_SHIFT
                                                      | (APM_COMPRESSED_FLAG + any(2))),
                                  .rows = rows, .columns = columns};
    size_t count = (size_t)rows * columns;
    uint32_t cells[CELLS], share = any(5);
    ApmLayerCell layer[CELLS];
    for (size_t i = 0; i < count; i++) {
        cells[i] = any(4) >= share ? 0 : any(2) ? 1 + any(300) : any(UINT32_MAX) >> any(32);
        if (levels) cells[i] %= levels + 1;
        layer[i] = (ApmLayerCell){0};
        if (cells[i] && any(2))
            layer[i] = (ApmLayerCell){(uint8_t)any(200), (int8_t)any(3), 0, (uint8_t)any(256)};
    }
    const uint8_t *with = message->header.flags & APM_LAYER_FLAG ? (uint8_t *)layer : NULL;
    return write_payload(message->payload, PAYLOAD, &message->header, (uint8_t *)cells, with);
}

/* Flip bits of payload, flags and size of the matrix, fill with noise, cut short; or leave it. */
static size_t damage(Message *message, size_t size) {
    for (uint32_t n = any(4); n > 0; n--)
        message->payload[any((uint32_t)size)] ^= (uint8_t)(1u << any(8));
    if (any(6) == 0) message->header.rows ^= (uint16_t)(1u << any(16));
    if (any(6) == 0) message->header.columns ^= (uint16_t)(1u << any(16));
    if (any(6) == 0) message->header.flags ^= (uint16_t)(1u << any(3));
    if (any(12) == 0) message->header.flags ^= (uint16_t)(1u << any(16));
    if (any(6) == 0)
        for (size_t i = 0; i < size; i++) message->payload[i] = (uint8_t)any(256);
    return any(4) ? size : any((uint32_t)size + 1);
}

static int read_payload(uint8_t *cells, uint8_t *layer, const ApmHeader *header,
                        const uint8_t *code, size_t size) {
    const uint32_t levels = header->flags >> APM_LEVELS_SHIFT;
    const SeenShape shape = {header->rows, header->columns, levels};
    Problem problem;
    if (levels) return decompress_seen(cells, layer, shape, code, size, &problem);
    return decompress(cells, layer, (size_t)header->rows * header->columns, code, size, &problem);
}

/* Whether cells and layer are the same after a compression into, and out of, just enough memory. */
static bool survives(const Apm *apm) {
    size_t count = (size_t)apm->header.rows * apm->header.columns, capacity = 10 * count + 10;
    uint8_t *large = malloc(capacity);
    size_t size = write_payload(large, capacity, &apm->header, apm->cells, apm->layer);
    uint8_t *code = malloc(size), *cells = malloc(4 * count), *layer = malloc(4 * count);
    bool is_written
        = write_payload(code, size, &apm->header, apm->cells, apm->layer) == size
          && write_payload(large, size - 1, &apm->header, apm->cells, apm->layer) == 0;
    bool is_read = !read_payload(cells, apm->layer ? layer : NULL, &apm->header, code, size)
                   && memcmp(cells, apm->cells, 4 * count) == 0
                   && (!apm->layer || memcmp(layer, apm->layer, 4 * count) == 0);
    free(large);
    free(code);
    free(cells);
    free(layer);
    return is_written && is_read;
}

static int decode_many(long n) {
    static Message message;
    Bytes space = {0};
    long decoded = 0, wrong = 0;
    for (long i = 0; i < n; i++) {
        size_t size = sizeof(ApmHeader) + damage(&message, make(&message));
        uint8_t *exact = malloc(size); /* so that a byte too many is noticed */
        memcpy(exact, &message, size);
        Apm apm;
        Problem problem;
        if (apm_decode(&apm, &space, exact, size, &problem) == DECODED) {
            decoded++;
            if (apm.header.flags & APM_COMPRESSED_FLAG) wrong += !survives(&apm);
        }
        free(exact);
    }
    test_free(space.data);
    printf("%ld messages, %ld decoded, %ld wrong, %ld blocks leak\n", n, decoded, wrong, live);
    return wrong != 0 || live != 0;
}

/* ---- an instance ---------------------------------------------------------------------------- */

/* Ground all around two sensors, and an object. */
static void set_points(fmi3Instance c, int64_t time) {
    enum { SENSORS = 2, POINTS = 400 };
    struct {
        Frame frame;
        Sensor sensors[SENSORS];
        Point points[SENSORS * POINTS];
    } scan = {{{'L', 'P', 'T', 'S'}, 1, SENSORS, sizeof(Sensor)}, {{0}}, {{{0}, 0, 0}}};
    for (uint32_t k = 0; k < SENSORS; k++)
        scan.sensors[k] = (Sensor){.vehicle = k, .time = time, .position = {10.0 * k, 0, 2},
                                   .first = k * POINTS, .count = POINTS};
    for (uint32_t i = 0; i < SENSORS * POINTS; i++) {
        bool is_object = i % 20 == 0;
        scan.points[i] = (Point){{(float)(i % 40) - 20, (float)(i / 40) - 10, is_object ? -1 : -2},
                                 1, is_object ? 7 : GROUND};
    }
    set_binary(c, VR_points, &scan, sizeof scan);
}

static bool counts_area;

static void live_once(void) {
    static const int64_t compressed = 2, seen_area = 2, first = 0;
    fmi3Instance c = instantiate("perception");
    if (!c) return;
    const fmi3ValueReference form = VR_message, ego = VR_ego_id, index = VR_index;
    note(fmi3SetInt64(c, &form, 1, &compressed, 1));
    if (counts_area) note(fmi3SetInt64(c, &index, 1, &seen_area, 1));
    note(fmi3SetInt64(c, &ego, 1, &first, 1));
    initialise(c);
    for (int k = 0; k < 3; k++) {
        fmi3Binary sent;
        size_t size = get_binary(c, VR_apms, &sent);
        if (size) set_binary(c, VR_received, sent, size);
        set_points(c, k * 100000000LL);
        step(c, 0.1 * k, 0.1);
    }
    fmi3FreeInstance(c);
}

int main(int count, char **arguments) {
    countdown = -1;
    counts_area = count > 2; /* any second argument */
    if (count > 1 && strcmp(arguments[1], "starved") == 0) return starve(live_once);
    return decode_many(count > 1 ? atol(arguments[1]) : 1000);
}
