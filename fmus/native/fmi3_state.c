/* FMI 3.0 Co-Simulation around one ModelOps: getting, setting and serializing the FMU state.
 *
 * A state is one flat block: everything of the instance that changes in a simulation, then the
 * unit's private state. Serialized it also carries a checksum. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_log.h"
#include "fmi3_unit.h"
#include "fmi3_values.h"

typedef struct {
    /* At least one importer passes the state instead of its address to fmi3FreeFMUState; what it
     * then frees is this null pointer. */
    void *nothing;
    size_t size;
    uint8_t bytes[];
} Snapshot;

typedef struct {
    uint64_t owner;  /* hash of the instantiation token: states of other FMUs are refused */
    uint32_t mode, has_begun, is_stale, reserved;
    double time;
} Header;

typedef struct {
    char magic[8];
    uint64_t checksum, size;
} Envelope;
static const char MAGIC[8] = {'F', 'M', 'U', '3', 'S', 'T', 'A', '1'};

/* FNV-1a over 64 bits (draft-eastlake-fnv). */
static uint64_t hash(const uint8_t *bytes, size_t size) {
    uint64_t value = 14695981039346656037u;
    for (size_t i = 0; i < size; i++) value = (value ^ bytes[i]) * 1099511628211u;
    return value;
}

static uint64_t owner(void) {
    return hash((const uint8_t *)INSTANTIATION_TOKEN, strlen(INSTANTIATION_TOKEN));
}

/* ---- writing ------------------------------------------------------------------------------- */

/* Writes at `bytes + size`; only counts while `bytes` is null. */
typedef struct {
    uint8_t *bytes;
    size_t size;
} Writer;

static void put(Writer *writer, const void *source, size_t size) {
    if (writer->bytes && size != 0) memcpy(writer->bytes + writer->size, source, size);
    writer->size += size;
}

static void put_value(Writer *writer, const Value *value, const VariableInfo *info) {
    bool is_binary = info->type == BINARY;
    uint64_t size = is_binary ? value->binary.size : value->count * element_size(info->type);
    put(writer, &size, sizeof size);
    put(writer, is_binary ? value->binary.data : value->data, (size_t)size);
}

static size_t write_state(Instance *instance, uint8_t *bytes) {
    Writer writer = {bytes, 0};
    Header header = {
        .owner = owner(),
        .mode = (uint32_t)instance->mode,
        .has_begun = instance->has_begun,
        .is_stale = instance->is_stale,
        .time = instance->time,
    };
    put(&writer, &header, sizeof header);
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        if (VARIABLES[i].causality != STRUCTURAL_PARAMETER) continue;
        put(&writer, instance->values[i].data, sizeof(uint64_t));
        put(&writer, &instance->values[i].applied, sizeof(uint64_t));
    }
    for (size_t i = 0; i < VARIABLE_COUNT; i++)
        if (VARIABLES[i].causality != STRUCTURAL_PARAMETER)
            put_value(&writer, &instance->values[i], &VARIABLES[i]);
    uint64_t size = MODEL.save ? MODEL.save(instance, instance->model, NULL) : 0;
    put(&writer, &size, sizeof size);
    if (bytes && size != 0) MODEL.save(instance, instance->model, bytes + writer.size);
    return writer.size + (size_t)size;
}

/* ---- reading ------------------------------------------------------------------------------- */

typedef struct {
    const uint8_t *position;
    size_t left;
} Reader;

/* The next `size` bytes, or null if so many are not left. */
static const uint8_t *take(Reader *reader, uint64_t size) {
    if (size > reader->left) return NULL;
    const uint8_t *start = reader->position;
    reader->position += size;
    reader->left -= (size_t)size;
    return start;
}

static bool take_number(Reader *reader, uint64_t *number) {
    const uint8_t *bytes = take(reader, sizeof *number);
    if (bytes) memcpy(number, bytes, sizeof *number);
    return bytes != NULL;
}

static bool read_header(Reader *reader, Header *header) {
    const uint8_t *bytes = take(reader, sizeof *header);
    if (!bytes) return false;
    memcpy(header, bytes, sizeof *header);
    return header->owner == owner() && header->mode < FAILED && header->has_begun <= 1
           && header->is_stale <= 1 && isfinite(header->time);
}

static bool is_allowed(const VariableInfo *info, uint64_t number) {
    return (double)number >= info->minimum && (double)number <= info->maximum;
}

/* Let `data` of the structural parameters be the sizes of the arrays in the state. */
static bool propose_sizes(Instance *instance, Reader *reader) {
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        if (VARIABLES[i].causality != STRUCTURAL_PARAMETER) continue;
        uint64_t pending, applied;
        if (!take_number(reader, &pending) || !take_number(reader, &applied)) return false;
        if (!is_allowed(&VARIABLES[i], pending) || !is_allowed(&VARIABLES[i], applied))
            return false;
        *(uint64_t *)instance->values[i].data = applied;
    }
    return true;
}

/* Whether values of a state could have been set; the bytes may come from a file. */
static bool are_allowed(Instance *instance, const VariableInfo *info, const uint8_t *bytes,
                        size_t count) {
    double value = 0;
    size_t i = first_outside(info, bytes, count, &value);
    if (i == count) return true;
    refuse(instance, "fmi3SetFMUState", "element %zu of `%s` is %.9g in the state, allowed are %.9g "
           "to %.9g", i, info->name, value, info->minimum, info->maximum);
    return false;
}

/* Check that every value is complete, is allowed and has room; change none. */
static bool check_values(Instance *instance, Reader *reader) {
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const VariableInfo *info = &VARIABLES[i];
        Value *value = &instance->values[i];
        if (info->causality == STRUCTURAL_PARAMETER) continue;
        uint64_t size;
        const uint8_t *bytes;
        if (!take_number(reader, &size) || !(bytes = take(reader, size))) return false;
        if (info->type == BINARY) {
            if (binary_reserve(&value->binary, (size_t)size)) return false;
            continue;
        }
        size_t count;
        if (!wanted_count(instance, (fmi3ValueReference)i, &count)) return false;
        if (size != (uint64_t)count * element_size(info->type)) return false;
        if (!reserve_elements(value, info->type, count)) return false;
        if (!are_allowed(instance, info, bytes, count)) return false;
    }
    return true;
}

static bool check_model_state(Reader *reader) {
    uint64_t size;
    return take_number(reader, &size) && size == reader->left;
}

static bool check_state(Instance *instance, Reader reader, Header *header) {
    bool is_valid = read_header(&reader, header) && propose_sizes(instance, &reader)
                    && check_values(instance, &reader) && check_model_state(&reader);
    if (is_valid) return true;
    for (size_t i = 0; i < VARIABLE_COUNT; i++)
        if (VARIABLES[i].causality == STRUCTURAL_PARAMETER && instance->values[i].data)
            *(uint64_t *)instance->values[i].data = instance->values[i].applied;
    return false;
}

/* Copy one checked value; whether it differed from the present one. */
static bool copy_value(Value *value, const VariableInfo *info, Reader *reader) {
    uint64_t size = 0;
    take_number(reader, &size);
    const uint8_t *bytes = take(reader, size);
    if (info->type == BINARY) {
        value->binary.size = (size_t)size;
        if (size != 0) memcpy(value->binary.data, bytes, (size_t)size);
        return false;
    }
    size_t count = (size_t)size / element_size(info->type);
    bool differs = count != value->count || (size != 0 && memcmp(value->data, bytes, size) != 0);
    value->count = count;
    if (info->type == BOOLEAN)
        for (size_t i = 0; i < count; i++) ((fmi3Boolean *)value->data)[i] = bytes[i] != 0;
    else if (size != 0)
        memcpy(value->data, bytes, (size_t)size);
    return differs;
}

/* Copy all checked values; whether a parameter that is fixed differs. */
static bool copy_values(Instance *instance, Reader *reader) {
    bool has_other_parameters = false;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        if (VARIABLES[i].causality != STRUCTURAL_PARAMETER) continue;
        take_number(reader, instance->values[i].data);
        uint64_t before = instance->values[i].applied;
        take_number(reader, &instance->values[i].applied);
        if (!VARIABLES[i].is_tunable && before != instance->values[i].applied)
            has_other_parameters = true;
    }
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const VariableInfo *info = &VARIABLES[i];
        if (info->causality == STRUCTURAL_PARAMETER) continue;
        bool differs = copy_value(&instance->values[i], info, reader);
        if (differs && info->causality == PARAMETER && !info->is_tunable)
            has_other_parameters = true;
    }
    return has_other_parameters;
}

static ModelStatus load_model(Instance *instance, Reader *reader) {
    uint64_t size = 0;
    take_number(reader, &size);
    if (MODEL.load) return MODEL.load(instance, instance->model, reader->position, (size_t)size);
    return size == 0 ? MODEL_OK : MODEL_ERROR;
}

static fmi3Status restore(Instance *instance, Reader reader, const Header *header) {
    take(&reader, sizeof *header);
    bool has_other_parameters = copy_values(instance, &reader);
    instance->mode = (Mode)header->mode;
    instance->time = header->time;
    ModelStatus status = MODEL_OK;
    /* What `begin` derived from other parameters is of no use here. */
    if (has_other_parameters || instance->has_begun != (header->has_begun != 0)) {
        status = recreate_model(instance);
        if (status <= MODEL_WARNING && header->has_begun) status = begin_model(instance);
    }
    if (status <= MODEL_WARNING) status = load_model(instance, &reader);
    instance->is_stale = header->is_stale != 0;
    return settle(instance, status);
}

/* ---- functions of the standard ------------------------------------------------------------- */

static Snapshot *resized(fmi3FMUState *state, size_t size) {
    Snapshot *snapshot = realloc(*state, sizeof *snapshot + size);
    if (!snapshot) return NULL;
    snapshot->nothing = NULL;
    snapshot->size = size;
    *state = snapshot;
    return snapshot;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *FMUState) {
    Instance *instance = c;
    if (!instance || !FMUState) return fmi3Error;
    if (instance->mode == FAILED) return refuse_mode(instance, __func__);
    Snapshot *snapshot = resized(FMUState, write_state(instance, NULL));
    if (!snapshot) return refuse(instance, __func__, "out of memory");
    write_state(instance, snapshot->bytes);
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState FMUState) {
    Instance *instance = c;
    Snapshot *snapshot = FMUState;
    if (!instance) return fmi3Error;
    if (!snapshot) return refuse(instance, __func__, "the state is a null pointer");
    Reader reader = {snapshot->bytes, snapshot->size};
    Header header;
    if (!check_state(instance, reader, &header))
        return refuse(instance, __func__, "not a state of this FMU, or out of memory");
    fmi3Status status = restore(instance, reader, &header);
    if (status > fmi3Warning) refuse(instance, __func__, "the model refuses its private state");
    return status;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *FMUState) {
    (void)c;
    if (!FMUState) return fmi3OK;
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState FMUState, size_t *size) {
    Instance *instance = c;
    const Snapshot *snapshot = FMUState;
    if (!instance) return fmi3Error;
    if (!snapshot) return refuse(instance, __func__, "the state is a null pointer");
    *size = sizeof(Envelope) + snapshot->size;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    Instance *instance = c;
    const Snapshot *snapshot = FMUState;
    if (!instance) return fmi3Error;
    if (!snapshot) return refuse(instance, __func__, "the state is a null pointer");
    if (size < sizeof(Envelope) + snapshot->size)
        return refuse(instance, __func__, "%zu bytes are too few for a state of %zu", size,
                      sizeof(Envelope) + snapshot->size);
    Envelope envelope = {.checksum = hash(snapshot->bytes, snapshot->size),
                         .size = snapshot->size};
    memcpy(envelope.magic, MAGIC, sizeof MAGIC);
    memcpy(serializedState, &envelope, sizeof envelope);
    memcpy(serializedState + sizeof envelope, snapshot->bytes, snapshot->size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    Instance *instance = c;
    if (!instance || !FMUState) return fmi3Error;
    Envelope envelope;
    if (size >= sizeof envelope) memcpy(&envelope, serializedState, sizeof envelope);
    if (size < sizeof envelope || memcmp(envelope.magic, MAGIC, sizeof MAGIC) != 0
        || envelope.size > size - sizeof envelope
        || envelope.checksum != hash(serializedState + sizeof envelope, (size_t)envelope.size))
        return refuse(instance, __func__, "the %zu bytes are damaged or no FMU state", size);
    Snapshot *snapshot = resized(FMUState, (size_t)envelope.size);
    if (!snapshot) return refuse(instance, __func__, "out of memory");
    memcpy(snapshot->bytes, serializedState + sizeof envelope, snapshot->size);
    return fmi3OK;
}
