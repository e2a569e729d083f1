#include "fmi3_values.h"

#include <stdlib.h>
#include <string.h>

size_t element_size(ValueType type) {
    static const size_t SIZES[] = {
        [FLOAT32] = sizeof(fmi3Float32), [FLOAT64] = sizeof(fmi3Float64),
        [INT8] = sizeof(fmi3Int8),       [UINT8] = sizeof(fmi3UInt8),
        [INT16] = sizeof(fmi3Int16),     [UINT16] = sizeof(fmi3UInt16),
        [INT32] = sizeof(fmi3Int32),     [UINT32] = sizeof(fmi3UInt32),
        [INT64] = sizeof(fmi3Int64),     [UINT64] = sizeof(fmi3UInt64),
        [BOOLEAN] = sizeof(fmi3Boolean), [BINARY] = 0,
    };
    return SIZES[type];
}

/* ---- the model's view ---------------------------------------------------------------------- */

void *variable_data(Instance *instance, uint32_t value_reference) {
    return instance->values[value_reference].data;
}

size_t variable_length(Instance *instance, uint32_t value_reference) {
    return instance->values[value_reference].count;
}

Binary *variable_binary(Instance *instance, uint32_t value_reference) {
    return &instance->values[value_reference].binary;
}

int binary_reserve(Binary *binary, size_t size) {
    if (size <= binary->capacity) return 0;
    if (size > SIZE_MAX / 2) return 1;
    size_t capacity = size + size / 2 + 64; /* frames grow: not one realloc for each */
    uint8_t *data = realloc(binary->data, capacity);
    if (!data) return 1;
    binary->data = data;
    binary->capacity = capacity;
    return 0;
}

/* ---- sizes and start values ---------------------------------------------------------------- */

bool allocate_values(Instance *instance) {
    instance->values = calloc(VARIABLE_COUNT, sizeof *instance->values);
    return instance->values != NULL;
}

void free_values(Instance *instance) {
    if (!instance->values) return;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        free(instance->values[i].data);
        free(instance->values[i].binary.data);
    }
    free(instance->values);
}

static uint64_t structural(const Instance *instance, fmi3ValueReference reference) {
    return *(const uint64_t *)instance->values[reference].data;
}

bool wanted_count(const Instance *instance, fmi3ValueReference reference, size_t *count) {
    const VariableInfo *info = &VARIABLES[reference];
    uint64_t product = info->type == BINARY ? 0 : 1;
    for (size_t k = 0; k < info->rank; k++) {
        const Dimension *axis = &info->dimensions[k];
        uint64_t length = axis->is_structural ? structural(instance, axis->reference)
                                              : axis->length;
        if (length != 0 && product > SIZE_MAX / 16 / length) return false;
        product *= length;
    }
    *count = (size_t)product;
    return true;
}

bool reserve_elements(Value *value, ValueType type, size_t count) {
    if (count <= value->capacity) return true;
    if (count > SIZE_MAX / 16) return false;
    void *data = realloc(value->data, count * element_size(type));
    if (!data) return false;
    value->data = data;
    value->capacity = count;
    return true;
}

#define FILL(TYPE)                                                    \
    do {                                                              \
        TYPE *element = value->data;                                  \
        for (size_t i = 0; i < value->count; i++)                     \
            element[i] = (TYPE)info->start;                           \
    } while (0)

static void fill_with_start(Value *value, const VariableInfo *info) {
    switch (info->type) {
        FOR_NUMBERS(FILL)
        case BOOLEAN: FILL(fmi3Boolean); break;
        case BINARY: value->binary.size = 0; break;
    }
}

static bool has_changed_axis(const Instance *instance, const VariableInfo *info) {
    for (size_t k = 0; k < info->rank; k++) {
        const Dimension *axis = &info->dimensions[k];
        if (axis->is_structural && structural(instance, axis->reference)
                                       != instance->values[axis->reference].applied)
            return true;
    }
    return false;
}

/* Memory first, for all variables: a failure leaves every size as it was. */
static bool reserve_wanted(Instance *instance) {
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        size_t count;
        if (!wanted_count(instance, (fmi3ValueReference)i, &count)) return false;
        if (!reserve_elements(&instance->values[i], VARIABLES[i].type, count)) return false;
    }
    return true;
}

bool reset_values(Instance *instance) {
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        if (VARIABLES[i].causality != STRUCTURAL_PARAMETER) continue;
        Value *value = &instance->values[i];
        if (!reserve_elements(value, UINT64, 1)) return false;
        *(uint64_t *)value->data = value->applied = (uint64_t)VARIABLES[i].start;
    }
    if (!reserve_wanted(instance)) return false;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        wanted_count(instance, (fmi3ValueReference)i, &instance->values[i].count);
        fill_with_start(&instance->values[i], &VARIABLES[i]);
    }
    return true;
}

bool apply_sizes(Instance *instance) {
    if (!reserve_wanted(instance)) {
        for (size_t i = 0; i < VARIABLE_COUNT; i++)
            if (VARIABLES[i].causality == STRUCTURAL_PARAMETER)
                *(uint64_t *)instance->values[i].data = instance->values[i].applied;
        return false;
    }
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        if (!has_changed_axis(instance, &VARIABLES[i])) continue;
        wanted_count(instance, (fmi3ValueReference)i, &instance->values[i].count);
        fill_with_start(&instance->values[i], &VARIABLES[i]);
        instance->is_stale = true;
    }
    for (size_t i = 0; i < VARIABLE_COUNT; i++)
        if (VARIABLES[i].causality == STRUCTURAL_PARAMETER)
            instance->values[i].applied = structural(instance, (fmi3ValueReference)i);
    return true;
}

/* ---- bounds -------------------------------------------------------------------------------- */

#define FIRST_OUTSIDE(TYPE)                                                                   \
    for (size_t i = 0; i < count; i++) {                                                      \
        TYPE element; /* in a saved state they lie anywhere */                                \
        memcpy(&element, (const char *)values + i * sizeof element, sizeof element);          \
        if ((double)element >= info->minimum && (double)element <= info->maximum) continue;   \
        /* NaN comes here, too */                                                             \
        *value = (double)element;                                                             \
        return i;                                                                             \
    }

size_t first_outside(const VariableInfo *info, const void *values, size_t count, double *value) {
    bool is_parameter = info->causality == PARAMETER || info->causality == STRUCTURAL_PARAMETER;
    if (!is_parameter && !info->is_bounded) return count;
    switch (info->type) {
        FOR_NUMBERS(FIRST_OUTSIDE)
        case BOOLEAN:
        case BINARY: break;
    }
    return count;
}
