/* The values of the variables and their sizes; what fmi3_model.h shows of them to the unit stands in
 * fmi3_values.c, too. */
#ifndef FMI3_VALUES_H
#define FMI3_VALUES_H
#include "fmi3_instance.h"

size_t element_size(ValueType);
bool allocate_values(Instance *);
void free_values(Instance *);
/* All variables get their start values and the sizes that belong to them. */
bool reset_values(Instance *);
/* The arrays take the sizes that the structural parameters say; false and no change if memory is
 * short. Arrays along a changed axis are filled with their start value. */
bool apply_sizes(Instance *);
/* Elements that `reference` has for the current structural parameters; false if that overflows. */
bool wanted_count(const Instance *, fmi3ValueReference reference, size_t *count);
bool reserve_elements(Value *, ValueType, size_t count);
/* Index of the first of `count` elements that is outside the bounds of the variable, or no number, and
 * its value; `count` if there is none. Parameters have bounds, and what declares them. */
size_t first_outside(const VariableInfo *, const void *elements, size_t count, double *value);

/* The cases of a switch over a ValueType that are numbers: DO(the type of an element). */
#define FOR_NUMBERS(DO)                   \
    case FLOAT32: DO(fmi3Float32); break; \
    case FLOAT64: DO(fmi3Float64); break; \
    case INT8: DO(fmi3Int8); break;       \
    case UINT8: DO(fmi3UInt8); break;     \
    case INT16: DO(fmi3Int16); break;     \
    case UINT16: DO(fmi3UInt16); break;   \
    case INT32: DO(fmi3Int32); break;     \
    case UINT32: DO(fmi3UInt32); break;   \
    case INT64: DO(fmi3Int64); break;     \
    case UINT64: DO(fmi3UInt64); break;

#endif
