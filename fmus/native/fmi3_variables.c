/* FMI 3.0 Co-Simulation around one ModelOps: getting and setting variables. */
#include <math.h>
#include <string.h>

#include "fmi3_log.h"
#include "fmi3_unit.h"
#include "fmi3_values.h"

/* ---- checks of a value that is set --------------------------------------------------------- */

static bool is_settable(const Instance *instance, const VariableInfo *info) {
    switch (instance->mode) {
        case CONFIGURATION: return info->causality == STRUCTURAL_PARAMETER;
        case RECONFIGURATION: return info->causality == STRUCTURAL_PARAMETER && info->is_tunable;
        case INSTANTIATED:
        case INITIALIZATION: return info->causality == PARAMETER || info->causality == INPUT;
        case EVENT:
        case STEP:
            return info->causality == INPUT
                   || (info->causality == PARAMETER && info->is_tunable);
        default: return false;
    }
}

static fmi3Status check_new_values(Instance *instance, const char *function,
                                   const VariableInfo *info, const void *values, size_t count) {
    if (!is_settable(instance, info))
        return refuse(instance, function, "`%s` cannot be set in %s", info->name,
                      mode_name(instance->mode));
    double value = 0;
    size_t i = first_outside(info, values, count, &value);
    if (i == count) return fmi3OK;
    if (isnan(value))
        return refuse(instance, function, "element %zu of `%s` is not a number", i, info->name);
    if (info->items)
        return refuse(instance, function, "element %zu of `%s` is %.9g, allowed are %s", i,
                      info->name, value, info->items);
    return refuse(instance, function, "element %zu of `%s` is %.9g, allowed are %.9g to %.9g", i,
                  info->name, value, info->minimum, info->maximum);
}

/* ---- access by the importer ---------------------------------------------------------------- */

static fmi3Status check_references(Instance *instance, const char *function, ValueType type,
                                   const fmi3ValueReference references[], size_t count,
                                   size_t nValues) {
    size_t total = 0;
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= VARIABLE_COUNT || VARIABLES[references[i]].type != type)
            return refuse(instance, function, "no variable of this type has the reference %u",
                          references[i]);
        total += type == BINARY ? 1 : instance->values[references[i]].count;
    }
    if (total == nValues) return fmi3OK;
    return refuse(instance, function,
                  "nValues is %zu, but the %zu variables from `%s` on have %zu elements", nValues,
                  count, count ? VARIABLES[references[0]].name : "", total);
}

static fmi3Status bring_up_to_date(Instance *instance) {
    bool is_evaluated = instance->mode == INITIALIZATION || instance->mode == EVENT;
    return is_evaluated ? refresh_outputs(instance) : fmi3OK;
}

static bool has_output(const fmi3ValueReference references[], size_t count) {
    for (size_t i = 0; i < count; i++)
        if (VARIABLES[references[i]].causality == OUTPUT) return true;
    return false;
}

static fmi3Status get_values(Instance *instance, const char *function, ValueType type,
                             const fmi3ValueReference references[], size_t count, void *values,
                             size_t nValues) {
    if (!instance) return fmi3Error;
    fmi3Status status = check_references(instance, function, type, references, count, nValues);
    if (status == fmi3OK && has_output(references, count)) status = bring_up_to_date(instance);
    if (status > fmi3Warning) return status;
    char *target = values;
    for (size_t i = 0; i < count; i++) {
        const Value *value = &instance->values[references[i]];
        size_t size = value->count * element_size(type);
        if (VARIABLES[references[i]].causality == INDEPENDENT)
            memcpy(target, &instance->time, size);
        else if (size != 0)
            memcpy(target, value->data, size);
        target += size;
    }
    return status;
}

/* A parameter that arrives after `begin` changes what `begin` has made of it: once more. */
static fmi3Status note_change(Instance *instance, VariableCausality causality) {
    instance->is_stale = true;
    bool is_late =
        causality == PARAMETER && instance->mode == INITIALIZATION && instance->has_begun;
    return is_late ? settle(instance, recreate_model(instance)) : fmi3OK;
}

static fmi3Status set_values(Instance *instance, const char *function, ValueType type,
                             const fmi3ValueReference references[], size_t count,
                             const void *values, size_t nValues) {
    if (!instance) return fmi3Error;
    fmi3Status status = check_references(instance, function, type, references, count, nValues);
    const char *source = values;
    for (size_t i = 0; i < count && status == fmi3OK; i++) { /* all or nothing */
        size_t elements = instance->values[references[i]].count;
        status = check_new_values(instance, function, &VARIABLES[references[i]], source, elements);
        source += elements * element_size(type);
    }
    source = values;
    for (size_t i = 0; i < count && status <= fmi3Warning; i++) {
        Value *value = &instance->values[references[i]];
        size_t size = value->count * element_size(type);
        if (type == BOOLEAN) /* importers in C may pass any byte but 0 for true */
            for (size_t k = 0; k < value->count; k++)
                ((fmi3Boolean *)value->data)[k] = source[k] != 0;
        else if (size != 0)
            memcpy(value->data, source, size);
        source += size;
        status = note_change(instance, VARIABLES[references[i]].causality);
    }
    return status;
}

#define ACCESS(NAME, TYPE)                                                                     \
    fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference valueReferences[],       \
                             size_t nValueReferences, fmi3##NAME values[], size_t nValues) {   \
        return get_values(c, __func__, TYPE, valueReferences, nValueReferences, values,        \
                          nValues);                                                            \
    }                                                                                          \
    fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference valueReferences[],       \
                             size_t nValueReferences, const fmi3##NAME values[],               \
                             size_t nValues) {                                                 \
        return set_values(c, __func__, TYPE, valueReferences, nValueReferences, values,        \
                          nValues);                                                            \
    }
ACCESS(Float32, FLOAT32)
ACCESS(Float64, FLOAT64)
ACCESS(Int8, INT8)
ACCESS(UInt8, UINT8)
ACCESS(Int16, INT16)
ACCESS(UInt16, UINT16)
ACCESS(Int32, INT32)
ACCESS(UInt32, UINT32)
ACCESS(Int64, INT64)
ACCESS(UInt64, UINT64)
ACCESS(Boolean, BOOLEAN)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    static const fmi3Byte NOTHING[1]; /* an empty Binary has an address too */
    Instance *instance = c;
    if (!instance) return fmi3Error;
    fmi3Status status = check_references(instance, __func__, BINARY, valueReferences,
                                         nValueReferences, nValues);
    if (status == fmi3OK && has_output(valueReferences, nValueReferences))
        status = bring_up_to_date(instance);
    for (size_t i = 0; i < nValueReferences && status <= fmi3Warning; i++) {
        const Binary *binary = &instance->values[valueReferences[i]].binary;
        valueSizes[i] = binary->size;
        values[i] = binary->data ? binary->data : NOTHING;
    }
    return status;
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
    Instance *instance = c;
    if (!instance) return fmi3Error;
    fmi3Status status = check_references(instance, __func__, BINARY, valueReferences,
                                         nValueReferences, nValues);
    for (size_t i = 0; i < nValueReferences && status == fmi3OK; i++) { /* all or nothing */
        const VariableInfo *info = &VARIABLES[valueReferences[i]];
        if (!is_settable(instance, info))
            status = refuse(instance, __func__, "`%s` cannot be set in %s", info->name,
                            mode_name(instance->mode));
        else if (binary_reserve(&instance->values[valueReferences[i]].binary, valueSizes[i]))
            status = refuse(instance, __func__, "out of memory for %zu bytes of `%s`",
                            valueSizes[i], info->name);
    }
    for (size_t i = 0; i < nValueReferences && status <= fmi3Warning; i++) {
        Binary *binary = &instance->values[valueReferences[i]].binary;
        if (valueSizes[i] != 0) memcpy(binary->data, values[i], valueSizes[i]);
        binary->size = valueSizes[i];
        status = note_change(instance, VARIABLES[valueReferences[i]].causality);
    }
    return status;
}
