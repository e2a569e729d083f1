#include "compression.h"

#include "records.h"

#include <string.h>

/* What the first byte of an item of the cells says: a run of 1..32 cells without points; 1..208
 * points; the upper part of 209..3792 points, whose lower part is the next byte; or that the number
 * of points is in the next 2 or 4 bytes. */
enum {
    RUN = CELLS_PER_BYTE,
    SMALL = RUN,
    MEDIUM = 240,
    WORD = 254,
    LONG_WORD = 255,
    FIRST_MEDIUM = MEDIUM - SMALL + 1,
    FIRST_WORD = FIRST_MEDIUM + (WORD - MEDIUM) * 256,
};

/* What the first byte of an item of the layer says: a run of 1..128 cells without an object; number
 * 0..126 of an object that came before, or that another one follows. */
enum { LAYER_RUN = 128, NUMBERS = 127, OTHER = 255 };

/* The objects so far; height and velocity make one. */
typedef struct {
    ApmLayerCell objects[NUMBERS];
    size_t count;
} Known;

static uint32_t index_of(const uint8_t *cells, size_t cell) {
    uint32_t index;
    memcpy(&index, cells + cell * sizeof index, sizeof index);
    return index;
}

/* ---- writing -------------------------------------------------------------------------------- */

typedef struct {
    uint8_t *start;
    size_t size, capacity; /* nothing is written beyond the capacity, but it is counted */
} Writer;

static void put(Writer *out, uint32_t byte) {
    if (out->size < out->capacity) out->start[out->size] = (uint8_t)byte;
    out->size++;
}

static void put_run(Writer *out, size_t run, size_t longest) {
    for (; run > longest; run -= longest) put(out, (uint32_t)longest - 1);
    if (run) put(out, (uint32_t)run - 1);
}

static void put_word(Writer *out, uint32_t first, uint32_t word, int bytes) {
    put(out, first);
    for (int i = 0; i < bytes; i++) put(out, word >> 8 * i & 255);
}

static void put_index(Writer *out, uint32_t index) {
    if (index < FIRST_MEDIUM) put(out, SMALL + index - 1);
    else if (index < FIRST_WORD)
        put_word(out, MEDIUM + (index - FIRST_MEDIUM) / 256, index - FIRST_MEDIUM, 1);
    else if (index <= UINT16_MAX) put_word(out, WORD, index, 2);
    else put_word(out, LONG_WORD, index, 4);
}

static void put_cells(Writer *out, const uint8_t *cells, size_t count) {
    size_t run = 0;
    for (size_t i = 0; i < count && out->size <= out->capacity; i++) {
        uint32_t index = index_of(cells, i);
        if (index == 0) {
            run++;
            continue;
        }
        put_run(out, run, RUN);
        put_index(out, index);
        run = 0;
    }
    put_run(out, run, RUN);
}

static int is_same(const ApmLayerCell *a, const ApmLayerCell *b) {
    return a->height == b->height && a->vx == b->vx && a->vy == b->vy;
}

static void put_object(Writer *out, Known *known, const ApmLayerCell *object) {
    size_t number = 0;
    while (number < known->count && !is_same(&known->objects[number], object)) number++;
    if (number < known->count) put(out, LAYER_RUN + (uint32_t)number);
    else {
        if (known->count < NUMBERS) known->objects[known->count++] = *object;
        put(out, OTHER);
        put(out, object->height);
        put(out, (uint8_t)object->vx);
        put(out, (uint8_t)object->vy);
    }
    put(out, object->points);
}

/* Fails if the layer says something about a cell without points. */
static int put_layer(Writer *out, const uint8_t *cells, const uint8_t *layer, size_t count) {
    Known known = {.count = 0};
    size_t run = 0;
    for (size_t i = 0; i < count && out->size <= out->capacity; i++) {
        static const ApmLayerCell nothing = {0};
        ApmLayerCell cell;
        memcpy(&cell, layer + i * sizeof cell, sizeof cell);
        int is_nothing = is_same(&cell, &nothing) && cell.points == 0;
        if (index_of(cells, i) == 0) {
            if (!is_nothing) return 1;
        } else if (is_nothing) run++;
        else {
            put_run(out, run, LAYER_RUN);
            put_object(out, &known, &cell);
            run = 0;
        }
    }
    put_run(out, run, LAYER_RUN);
    return 0;
}

size_t compress(uint8_t *out, size_t capacity, const uint8_t *cells, const uint8_t *layer,
                size_t count) {
    Writer writer = {out, 0, capacity};
    put_cells(&writer, cells, count);
    if (layer && put_layer(&writer, cells, layer, count)) return 0;
    return writer.size <= capacity ? writer.size : 0;
}

/* ---- reading -------------------------------------------------------------------------------- */

typedef struct {
    const uint8_t *next;
    size_t rest;
} Reader;

/* The next `size` bytes as a little-endian number. */
static int take(Reader *in, size_t size, uint32_t *number) {
    if (in->rest < size) return 1;
    *number = 0;
    for (size_t i = 0; i < size; i++) *number |= (uint32_t)in->next[i] << 8 * i;
    in->next += size;
    in->rest -= size;
    return 0;
}

static int take_index(Reader *in, uint32_t first, uint32_t *index) {
    if (first >= WORD) return take(in, first == WORD ? 2 : 4, index);
    if (first < MEDIUM) {
        *index = first - SMALL + 1;
        return 0;
    }
    if (take(in, 1, index)) return 1;
    *index += FIRST_MEDIUM + (first - MEDIUM) * 256;
    return 0;
}

static int cut_short(Problem *problem) { return fail(problem, "a compressed APM is cut short"); }

static int take_cells(Reader *in, uint8_t *cells, size_t count, Problem *problem) {
    for (size_t i = 0; i < count;) {
        uint32_t first, index = 0;
        size_t run = 1;
        if (take(in, 1, &first) || (first >= RUN && take_index(in, first, &index)))
            return cut_short(problem);
        if (first < RUN) run += first;
        if (run > count - i)
            return fail(problem, "a run of %zu cells of a compressed APM passes its last cell",
                        run);
        memset(cells + i * sizeof index, 0, run * sizeof index);
        memcpy(cells + i * sizeof index, &index, sizeof index);
        i += run;
    }
    return 0;
}

static int take_object(Reader *in, Known *known, uint32_t first, ApmLayerCell *cell,
                       Problem *problem) {
    uint32_t byte[4] = {0};
    if (first == OTHER) {
        for (int i = 0; i < 3; i++)
            if (take(in, 1, &byte[i])) return cut_short(problem);
        *cell = (ApmLayerCell){(uint8_t)byte[0], (int8_t)byte[1], (int8_t)byte[2], 0};
        if (known->count < NUMBERS) known->objects[known->count++] = *cell;
    } else if (first - LAYER_RUN < known->count) *cell = known->objects[first - LAYER_RUN];
    else
        return fail(problem, "the layer of a compressed APM has no object %u yet",
                    (unsigned)(first - LAYER_RUN));
    if (take(in, 1, &byte[3])) return cut_short(problem);
    cell->points = (uint8_t)byte[3];
    return 0;
}

static int take_layer(Reader *in, const uint8_t *cells, uint8_t *layer, size_t count,
                      Problem *problem) {
    Known known = {.count = 0};
    size_t run = 0, left = 0; /* cells of the run, and those that are still to come */
    for (size_t i = 0; i < count; i++) {
        ApmLayerCell cell = {0};
        if (index_of(cells, i) != 0 && left > 0) left--;
        else if (index_of(cells, i) != 0) {
            uint32_t first;
            if (take(in, 1, &first)) return cut_short(problem);
            if (first < LAYER_RUN) run = (left = first) + 1;
            else if (take_object(in, &known, first, &cell, problem)) return 1;
        }
        memcpy(layer + i * sizeof cell, &cell, sizeof cell);
    }
    if (left)
        return fail(problem,
                    "a run of %zu cells of the layer of a compressed APM passes its last cell",
                    run);
    return 0;
}

int decompress(uint8_t *cells, uint8_t *layer, size_t count, const uint8_t *bytes, size_t size,
               Problem *problem) {
    Reader reader = {bytes, size};
    if (take_cells(&reader, cells, count, problem)
        || (layer && take_layer(&reader, cells, layer, count, problem)))
        return 1;
    if (reader.rest) return fail(problem, "a compressed APM has %zu bytes too many", reader.rest);
    return 0;
}
