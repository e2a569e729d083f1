#include "apm.h"

#include "compression.h"
#include "seen_compression.h"

#include <math.h>
#include <string.h>

/* A frame entry is a uint32 size, a uint32 zero and the message, padded to multiples of this. */
enum { PREFIX = 8, ALIGNMENT = 8 };

static size_t padded(size_t size) { return (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT; }

/* ---- the mobility-and-height layer ---------------------------------------------------------- */

/* For each cell the highest object and its points there. */
static void find_highest(LayerCell *cells, size_t count, const Scan *scan,
                         const Objects *objects) {
    for (size_t i = 0; i < count; i++) cells[i] = (LayerCell){NO_OBJECT, 0};
    for (size_t i = 0; i < scan->hit_count; i++) {
        uint32_t object = objects->of_cluster[scan->hits[i].cluster];
        if (object == NO_OBJECT) continue;
        LayerCell *cell = &cells[scan->hits[i].cell];
        if (cell->object == NO_OBJECT
            || objects->objects[object].height > objects->objects[cell->object].height)
            *cell = (LayerCell){object, 0};
        if (cell->object == object) cell->points++;
    }
}

static double bounded(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

/* Quantise: heights in steps of 0.05 m, at least one; velocities in steps of 0.25 m/s. */
static ApmLayerCell packed(const LayerCell *cell, const Objects *objects) {
    if (cell->object == NO_OBJECT) return (ApmLayerCell){0};
    const Object *object = &objects->objects[cell->object];
    return (ApmLayerCell){
        .height = (uint8_t)bounded(floor(object->height / 0.05 + 0.5), 1, UINT8_MAX),
        .vx = (int8_t)bounded(floor(object->velocity[0] / 0.25 + 0.5), -INT8_MAX, INT8_MAX),
        .vy = (int8_t)bounded(floor(object->velocity[1] / 0.25 + 0.5), -INT8_MAX, INT8_MAX),
        .points = (uint8_t)(cell->points < UINT8_MAX ? cell->points : UINT8_MAX),
    };
}

/* ---- writing -------------------------------------------------------------------------------- */

static ApmHeader header_of(const ScanSettings *settings, const Sensor *sensor, const Scan *scan,
                           int has_layer) {
    return (ApmHeader){
        .magic = {'A', 'P', 'M', 'M'},
        .version = 1,
        .flags = (uint16_t)((has_layer ? APM_LAYER_FLAG : 0)
                            | settings->levels << APM_LEVELS_SHIFT),
        .vehicle = sensor->vehicle,
        .time = sensor->time,
        .position = {sensor->position[0], sensor->position[1]},
        .heading = sensor->heading,
        .center = {scan->pose.center[0], scan->pose.center[1]},
        .cell = (float)settings->cell,
        .rows = (uint16_t)settings->rows,
        .columns = (uint16_t)settings->columns,
    };
}

/* Bytes of cells and layer in the plain form. */
static size_t payload_size(size_t cells, int has_layer) {
    return cells * (sizeof(uint32_t) + (has_layer ? sizeof(ApmLayerCell) : 0));
}

static uint32_t levels_of(const ApmHeader *header) { return header->flags >> APM_LEVELS_SHIFT; }

static SeenShape shape_of(const ApmHeader *header) {
    return (SeenShape){header->rows, header->columns, levels_of(header)};
}

/* Put prefix and header before the payload, which is in its place, as the last entry. */
static void finish(Bytes *bytes, size_t start, const ApmHeader *header, size_t payload) {
    const uint32_t prefix[] = {(uint32_t)(sizeof *header + payload), 0};
    memcpy(bytes->data + start, prefix, sizeof prefix);
    memcpy(bytes->data + start + PREFIX, header, sizeof *header);
    bytes->size = start + PREFIX + padded(sizeof *header + payload);
}

int apm_append(Bytes *bytes, Layer *layer, const ScanSettings *settings, const Sensor *sensor,
               const Scan *scan, const Objects *objects, Problem *problem) {
    ApmHeader header = header_of(settings, sensor, scan, objects != NULL);
    size_t start = bytes->size, cells = (size_t)settings->rows * settings->columns;
    size_t payload = payload_size(cells, objects != NULL);
    size_t size = PREFIX + padded(sizeof header + payload);
    if (reserve(&bytes->data, &bytes->capacity, start + size, 1, problem)
        || (objects
            && reserve(&layer->cells, &layer->capacity, cells, sizeof *layer->cells, problem)))
        return 1;
    memset(bytes->data + start, 0, size);
    uint8_t *out = bytes->data + start + PREFIX + sizeof header;
    memcpy(out, scan->cells, cells * sizeof(uint32_t));
    out += cells * sizeof(uint32_t);
    if (objects) {
        find_highest(layer->cells, cells, scan, objects);
        for (size_t i = 0; i < cells; i++, out += sizeof(ApmLayerCell)) {
            ApmLayerCell cell = packed(&layer->cells[i], objects);
            memcpy(out, &cell, sizeof cell);
        }
    }
    finish(bytes, start, &header, payload);
    return 0;
}

int apm_compress(Bytes *bytes, size_t start, Problem *problem) {
    size_t end = bytes->size;
    ApmHeader header;
    memcpy(&header, bytes->data + start + PREFIX, sizeof header);
    size_t count = (size_t)header.rows * header.columns;
    int has_layer = header.flags & APM_LAYER_FLAG;
    size_t plain = payload_size(count, has_layer);
    if (reserve(&bytes->data, &bytes->capacity, end + plain, 1, problem)) return 1;
    uint8_t *payload = bytes->data + start + PREFIX + sizeof header, *shorter = bytes->data + end;
    const uint8_t *layer = has_layer ? payload + count * sizeof(uint32_t) : NULL;
    size_t size = levels_of(&header)
                      ? compress_seen(shorter, plain - 1, payload, layer, shape_of(&header))
                      : compress(shorter, plain - 1, payload, layer, count);
    if (size == 0) return 0;
    header.flags |= APM_COMPRESSED_FLAG;
    memset(payload, 0, padded(size));
    memcpy(payload, shorter, size);
    finish(bytes, start, &header, size);
    return 0;
}

/* ---- reading -------------------------------------------------------------------------------- */

static int check_header(const ApmHeader *header, Problem *problem) {
    if (memcmp(header->magic, "APMM", 4) != 0 || header->version != 1)
        return fail(problem, "not an APM message of version 1");
    if (header->flags & ~(APM_LAYER_FLAG | APM_COMPRESSED_FLAG | APM_LEVELS))
        return fail(problem, "an APM message has unknown flags %#06x", (unsigned)header->flags);
    if (header->vehicle < 0)
        return fail(problem, "an APM message comes from vehicle %lld, must be >= 0",
                    (long long)header->vehicle);
    if (header->rows == 0 || header->columns == 0)
        return fail(problem, "an APM of %u x %u cells is empty", (unsigned)header->rows,
                    (unsigned)header->columns);
    if ((uint64_t)header->rows * header->columns > APM_MOST_CELLS)
        return fail(problem, "an APM of %u x %u cells is too large: at most %u cells",
                    (unsigned)header->rows, (unsigned)header->columns, APM_MOST_CELLS);
    if (!(isfinite(header->cell) && header->cell > 0))
        return fail(problem, "an APM has cells of %g m, must be finite and > 0",
                    (double)header->cell);
    const double pose[] = {header->position[0], header->position[1], header->heading,
                           header->center[0], header->center[1]};
    for (size_t i = 0; i < sizeof pose / sizeof *pose; i++)
        if (!isfinite(pose[i]) || (i == 2 && fabs(pose[i]) > ANGLE_LIMIT))
            return fail(problem, "the %s of an APM is %g",
                        i < 2 ? "position" : i == 2 ? "heading" : "center", pose[i]);
    return 0;
}

uint32_t apm_index(const Apm *apm, size_t cell) {
    uint32_t index;
    memcpy(&index, apm->cells + cell * sizeof index, sizeof index);
    return index;
}

/* Whether more is seen of a cell than all. */
static int is_above_levels(const Apm *apm, size_t count, Problem *problem) {
    uint32_t levels = levels_of(&apm->header), most = 0;
    if (levels == 0) return 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t index = apm_index(apm, i);
        if (index > most) most = index;
    }
    if (most <= levels) return 0;
    return fail(problem, "an APM of %u levels has a cell of %u", (unsigned)levels, (unsigned)most);
}

static Decoding decode_plain(Apm *apm, const uint8_t *payload, size_t size, Problem *problem) {
    const ApmHeader *header = &apm->header;
    size_t count = (size_t)header->rows * header->columns;
    int has_layer = header->flags & APM_LAYER_FLAG;
    size_t expected = payload_size(count, has_layer);
    if (size != expected) {
        fail(problem, "an APM message of %u x %u cells %s layer has %zu bytes, not %zu",
             (unsigned)header->rows, (unsigned)header->columns, has_layer ? "with" : "without",
             sizeof *header + expected, sizeof *header + size);
        return MALFORMED;
    }
    apm->cells = payload;
    apm->layer = has_layer ? payload + count * sizeof(uint32_t) : NULL;
    return is_above_levels(apm, count, problem) ? MALFORMED : DECODED;
}

static Decoding decode_compressed(Apm *apm, Bytes *space, const uint8_t *payload, size_t size,
                                  Problem *problem) {
    const ApmHeader *header = &apm->header;
    size_t count = (size_t)header->rows * header->columns;
    int has_layer = header->flags & APM_LAYER_FLAG;
    uint32_t levels = levels_of(header);
    if ((count - 1) / (levels ? SEEN_CELLS_PER_BYTE : CELLS_PER_BYTE) >= size) {
        fail(problem, "a compressed APM of %u x %u cells does not fit into %zu bytes",
             (unsigned)header->rows, (unsigned)header->columns, sizeof *header + size);
        return MALFORMED;
    }
    if (reserve(&space->data, &space->capacity, payload_size(count, has_layer), 1, problem))
        return OUT_OF_MEMORY;
    uint8_t *layer = has_layer ? space->data + count * sizeof(uint32_t) : NULL;
    if (levels ? decompress_seen(space->data, layer, shape_of(header), payload, size, problem)
               : decompress(space->data, layer, count, payload, size, problem))
        return MALFORMED;
    apm->cells = space->data;
    apm->layer = layer;
    return DECODED;
}

Decoding apm_decode(Apm *apm, Bytes *space, const uint8_t *message, size_t size,
                    Problem *problem) {
    ApmHeader *header = &apm->header;
    if (size < sizeof *header) {
        fail(problem, "an APM message has at least %zu bytes, not %zu", sizeof *header, size);
        return MALFORMED;
    }
    memcpy(header, message, sizeof *header);
    if (check_header(header, problem)) return MALFORMED;
    message += sizeof *header;
    size -= sizeof *header;
    return header->flags & APM_COMPRESSED_FLAG
               ? decode_compressed(apm, space, message, size, problem)
               : decode_plain(apm, message, size, problem);
}

int messages_open(Messages *messages, const uint8_t *signal, size_t size, Problem *problem) {
    *messages = (Messages){0};
    if (size == 0) return 0;
    Frame frame;
    if (size < sizeof frame)
        return fail(problem, "an `APMS` frame has at least 16 bytes, not %zu", size);
    memcpy(&frame, signal, sizeof frame);
    if (memcmp(frame.magic, "APMS", 4) != 0 || frame.version != 1 || frame.record_size != 0)
        return fail(problem, "not an `APMS` frame of version 1");
    size_t rest = size - sizeof frame;
    const uint8_t *at = signal + sizeof frame;
    for (uint32_t i = 0; i < frame.count; i++) {
        uint32_t length = 0;
        if (rest >= PREFIX) memcpy(&length, at, sizeof length);
        if (rest < PREFIX || rest - PREFIX < padded(length))
            return fail(problem, "the `APMS` frame of %u messages is cut short in message %u",
                        (unsigned)frame.count, (unsigned)i);
        at += PREFIX + padded(length);
        rest -= PREFIX + padded(length);
    }
    if (rest) return fail(problem, "the `APMS` frame has %zu bytes after its messages", rest);
    *messages = (Messages){signal + sizeof frame, frame.count};
    return 0;
}

int messages_next(Messages *messages, const uint8_t **message, size_t *size) {
    if (messages->count == 0) return 0;
    uint32_t length;
    memcpy(&length, messages->next, sizeof length);
    *message = messages->next + PREFIX;
    *size = length;
    messages->next += PREFIX + padded(length);
    messages->count--;
    return 1;
}
