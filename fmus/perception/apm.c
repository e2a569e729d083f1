#include "apm.h"

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
        .flags = has_layer ? APM_LAYER_FLAG : 0,
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

int apm_append(Bytes *bytes, Layer *layer, const ScanSettings *settings, const Sensor *sensor,
               const Scan *scan, const Objects *objects, Problem *problem) {
    size_t cells = (size_t)settings->rows * settings->columns;
    size_t size = sizeof(ApmHeader) + cells * sizeof(uint32_t);
    if (objects) size += cells * sizeof(ApmLayerCell);
    if (reserve(&bytes->data, &bytes->capacity, bytes->size + PREFIX + padded(size), 1, problem)
        || (objects
            && reserve(&layer->cells, &layer->capacity, cells, sizeof *layer->cells, problem)))
        return 1;
    uint8_t *out = bytes->data + bytes->size;
    memset(out, 0, PREFIX + padded(size));
    memcpy(out, &(uint32_t){(uint32_t)size}, sizeof(uint32_t));
    out += PREFIX;
    ApmHeader header = header_of(settings, sensor, scan, objects != NULL);
    memcpy(out, &header, sizeof header);
    out += sizeof header;
    memcpy(out, scan->cells, cells * sizeof(uint32_t));
    out += cells * sizeof(uint32_t);
    if (objects) {
        find_highest(layer->cells, cells, scan, objects);
        for (size_t i = 0; i < cells; i++, out += sizeof(ApmLayerCell)) {
            ApmLayerCell cell = packed(&layer->cells[i], objects);
            memcpy(out, &cell, sizeof cell);
        }
    }
    bytes->size += PREFIX + padded(size);
    return 0;
}

/* ---- reading -------------------------------------------------------------------------------- */

static int check_header(const ApmHeader *header, Problem *problem) {
    if (memcmp(header->magic, "APMM", 4) != 0 || header->version != 1)
        return fail(problem, "not an APM message of version 1");
    if (header->flags & ~APM_LAYER_FLAG)
        return fail(problem, "an APM message has unknown flags %#06x", (unsigned)header->flags);
    if (header->vehicle < 0)
        return fail(problem, "an APM message comes from vehicle %lld, must be >= 0",
                    (long long)header->vehicle);
    if (header->rows == 0 || header->columns == 0)
        return fail(problem, "an APM of %u x %u cells is empty", (unsigned)header->rows,
                    (unsigned)header->columns);
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

int apm_decode(Apm *apm, const uint8_t *message, size_t size, Problem *problem) {
    ApmHeader *header = &apm->header;
    if (size < sizeof *header)
        return fail(problem, "an APM message has at least %zu bytes, not %zu", sizeof *header,
                    size);
    memcpy(header, message, sizeof *header);
    if (check_header(header, problem)) return 1;
    uint64_t per_cell = header->flags & APM_LAYER_FLAG ? 8 : 4;
    uint64_t expected = sizeof *header + per_cell * header->rows * header->columns;
    if (size != expected)
        return fail(problem, "an APM message of %u x %u cells %s layer has %llu bytes, not %zu",
                    (unsigned)header->rows, (unsigned)header->columns,
                    header->flags & APM_LAYER_FLAG ? "with" : "without",
                    (unsigned long long)expected, size);
    apm->cells = message + sizeof *header;
    return 0;
}

uint32_t apm_index(const Apm *apm, size_t cell) {
    uint32_t index;
    memcpy(&index, apm->cells + cell * sizeof index, sizeof index);
    return index;
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
