#include "seen_compression.h"

#include "range_coder.h"
#include "records.h"

#include <string.h>

/* The cells beside one that come before it: rear, right, rear right, rear left. */
enum { NEIGHBOURS = 4 };
static const uint32_t ROWS_BACK[NEIGHBOURS] = {1, 0, 1, 1};
static const int COLUMNS_LEFT[NEIGHBOURS] = {0, -1, -1, 1};

/* Of a cell: nothing is seen, or all, or some. */
enum { CLASSES = 3, CELL_CONTEXTS = 81, LAYER_CONTEXTS = 1 << NEIGHBOURS };

typedef struct {
    Decision is_nothing[CELL_CONTEXTS], is_full[CELL_CONTEXTS];
    ByteDecisions between[CLASSES * CLASSES];
} CellDecisions;

typedef struct {
    Decision has_object[LAYER_CONTEXTS], is_same[LAYER_CONTEXTS];
    ByteDecisions height, vx, vy, points;
} LayerDecisions;

/* The numbers of a cell and of its neighbours. */
typedef struct {
    size_t cell, near[NEIGHBOURS];
    int is_inside[NEIGHBOURS];
} Place;

static Place place_of(SeenShape shape, uint32_t row, uint32_t column) {
    Place place = {.cell = (size_t)row * shape.columns + column};
    for (int k = 0; k < NEIGHBOURS; k++) {
        int64_t other = (int64_t)column + COLUMNS_LEFT[k];
        place.is_inside[k] = row >= ROWS_BACK[k] && other >= 0 && other < shape.columns;
        if (place.is_inside[k])
            place.near[k] = (size_t)(row - ROWS_BACK[k]) * shape.columns + (size_t)other;
    }
    return place;
}

/* ---- cells ---------------------------------------------------------------------------------- */

static uint32_t index_of(const uint8_t *cells, size_t cell) {
    uint32_t index;
    memcpy(&index, cells + cell * sizeof index, sizeof index);
    return index;
}

static uint32_t context_of(const uint8_t *cells, const Place *place, uint32_t levels) {
    uint32_t context = 0;
    for (int k = 0; k < NEIGHBOURS; k++) {
        uint32_t index = place->is_inside[k] ? index_of(cells, place->near[k]) : 0;
        context = CLASSES * context + (index == 0 ? 0 : index < levels ? 1 : 2);
    }
    return context;
}

static uint32_t code_cell(Coder *coder, CellDecisions *about, uint32_t context, uint32_t levels,
                          uint32_t index) {
    if (decide(coder, &about->is_nothing[context], index == 0)) return 0;
    if (levels == 1 || decide(coder, &about->is_full[context], index == levels)) return levels;
    ByteDecisions *between = &about->between[context / (CLASSES * CLASSES)]; /* rear and right */
    return 1 + decide_byte(coder, between, index - 1, levels - 2);
}

/* Code the cells row by row; what is read goes to `found`, which are the cells then. */
static void code_cells(Coder *coder, const uint8_t *cells, uint8_t *found, SeenShape shape) {
    CellDecisions about;
    decisions_reset((Decision *)&about, sizeof about / sizeof(Decision));
    for (uint32_t row = 0; row < shape.rows; row++)
        for (uint32_t column = 0; column < shape.columns; column++) {
            if (coder_is_exhausted(coder)) return;
            Place place = place_of(shape, row, column);
            uint32_t context = context_of(cells, &place, shape.levels);
            uint32_t index = found ? 0 : index_of(cells, place.cell);
            index = code_cell(coder, &about, context, shape.levels, index);
            if (found) memcpy(found + place.cell * sizeof index, &index, sizeof index);
        }
}

/* ---- layer ---------------------------------------------------------------------------------- */

static ApmLayerCell layer_of(const uint8_t *layer, size_t cell) {
    ApmLayerCell found;
    memcpy(&found, layer + cell * sizeof found, sizeof found);
    return found;
}

static int is_same_object(const ApmLayerCell *a, const ApmLayerCell *b) {
    return a->height == b->height && a->vx == b->vx && a->vy == b->vy;
}

static int is_nothing(const ApmLayerCell *cell) {
    static const ApmLayerCell nothing = {0};
    return is_same_object(cell, &nothing) && cell->points == 0;
}

/* In which neighbours something is; the first of them is expected here. */
static uint32_t expectation(const uint8_t *layer, const Place *place, ApmLayerCell *expected) {
    uint32_t context = 0;
    *expected = (ApmLayerCell){0};
    for (int k = 0; k < NEIGHBOURS; k++) {
        ApmLayerCell other = {0};
        if (place->is_inside[k]) other = layer_of(layer, place->near[k]);
        if (context == 0) *expected = other;
        context = 2 * context + !is_nothing(&other);
    }
    return context;
}

static int code_object(Coder *coder, LayerDecisions *about, uint32_t context,
                       const ApmLayerCell *expected, ApmLayerCell *cell, Problem *problem) {
    if (decide(coder, &about->is_same[context], is_same_object(cell, expected)))
        *cell = (ApmLayerCell){expected->height, expected->vx, expected->vy, cell->points};
    else {
        cell->height = (uint8_t)decide_byte(coder, &about->height, cell->height, UINT8_MAX);
        cell->vx = (int8_t)decide_byte(coder, &about->vx, (uint8_t)cell->vx, UINT8_MAX);
        cell->vy = (int8_t)decide_byte(coder, &about->vy, (uint8_t)cell->vy, UINT8_MAX);
        if (is_same_object(cell, expected))
            return fail(problem, "the layer of a compressed APM repeats an object instead of "
                        "saying so");
    }
    cell->points = (uint8_t)decide_byte(coder, &about->points, cell->points, UINT8_MAX);
    if (is_nothing(cell))
        return fail(problem, "the layer of a compressed APM has an object that is nothing");
    return 0;
}

/* Code the layer row by row; what is read goes to `found`, which is the layer then. */
static int code_layer(Coder *coder, const uint8_t *layer, uint8_t *found, SeenShape shape,
                      Problem *problem) {
    LayerDecisions about;
    decisions_reset((Decision *)&about, sizeof about / sizeof(Decision));
    for (uint32_t row = 0; row < shape.rows; row++)
        for (uint32_t column = 0; column < shape.columns; column++) {
            if (coder_is_exhausted(coder)) return 0;
            Place place = place_of(shape, row, column);
            ApmLayerCell expected, cell = {0};
            uint32_t context = expectation(layer, &place, &expected);
            if (!found) cell = layer_of(layer, place.cell);
            if (decide(coder, &about.has_object[context], !is_nothing(&cell))
                && code_object(coder, &about, context, &expected, &cell, problem))
                return 1;
            if (found) memcpy(found + place.cell * sizeof cell, &cell, sizeof cell);
        }
    return 0;
}

/* ---- all of it ------------------------------------------------------------------------------ */

size_t compress_seen(uint8_t *out, size_t capacity, const uint8_t *cells, const uint8_t *layer,
                     SeenShape shape) {
    Coder coder = coder_for_writing(out, capacity);
    Problem none; /* what is written is in its shortest form */
    code_cells(&coder, cells, NULL, shape);
    if (layer) code_layer(&coder, layer, NULL, shape, &none);
    return coder_finish_writing(&coder);
}

int decompress_seen(uint8_t *cells, uint8_t *layer, SeenShape shape, const uint8_t *bytes,
                    size_t size, Problem *problem) {
    Coder coder = coder_for_reading(bytes, size);
    code_cells(&coder, cells, cells, shape);
    int is_odd = layer && code_layer(&coder, layer, layer, shape, problem);
    return is_odd && !coder_is_exhausted(&coder) ? 1 : coder_finish_reading(&coder, problem);
}
