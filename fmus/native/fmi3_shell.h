/* Inside the shell: what its C files and the generated variables.c share. Units include only
 * fmi3_model.h. */
#ifndef FMI3_SHELL_H
#define FMI3_SHELL_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "fmi3_model.h"
#include "fmi3Functions.h"

#define MAX_RANK 4

typedef enum {
    FLOAT32, FLOAT64, INT8, UINT8, INT16, UINT16, INT32, UINT32, INT64, UINT64, BOOLEAN, BINARY
} ValueType;
typedef enum { INDEPENDENT, STRUCTURAL_PARAMETER, PARAMETER, INPUT, OUTPUT } VariableCausality;

/* One axis: `length` elements, or as many as the structural parameter `reference` says. */
typedef struct {
    bool is_structural;
    uint64_t length;
    fmi3ValueReference reference;
} Dimension;

/* One row of the generated table; its index is the value reference. */
typedef struct {
    const char *name;
    ValueType type;
    VariableCausality causality;
    bool is_tunable;
    bool is_bounded;          /* minimum or maximum is declared */
    double start;             /* of every element; Binary starts empty */
    double minimum, maximum;  /* inclusive; infinite where not declared */
    const char *items;        /* of an Enumeration, for messages: "1 (first), 2 (second)"; or NULL */
    size_t rank;
    Dimension dimensions[MAX_RANK];
} VariableInfo;

extern const VariableInfo VARIABLES[];
extern const size_t VARIABLE_COUNT;
extern const char INSTANTIATION_TOKEN[];

/* The value of one variable. Numbers: `count` elements in `data`, room for `capacity`. */
typedef struct {
    void *data;
    size_t count, capacity;
    Binary binary;
    uint64_t applied;  /* structural parameters: the value the arrays are sized by */
} Value;

/* FMI 3.0.2, figures 1 and 3: the super states of co-simulation. FAILED stands for "Terminated"
 * after an error of the model: only reading, reset, restoring and freeing remain. */
typedef enum {
    INSTANTIATED, CONFIGURATION, INITIALIZATION, EVENT, STEP, RECONFIGURATION, TERMINATED, FAILED
} Mode;

struct Instance {
    Mode mode;
    double time;
    Value *values;       /* one for each row of VARIABLES */
    void *model;         /* private state of the unit */
    bool has_begun;      /* MODEL.begin has run on it */
    bool is_stale;       /* inputs changed since the outputs were computed */
    bool uses_event_mode;
    unsigned log_mask;   /* bit = MODEL_OK ... MODEL_ERROR of the messages to pass on */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
};

/* fmi3_shell.c */
const char *mode_name(Mode);
fmi3Status refuse(Instance *, const char *function, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
fmi3Status refuse_mode(Instance *, const char *function);
/* Run a callback's status through the state machine: an error makes the instance FAILED. */
fmi3Status settle(Instance *, ModelStatus);
ModelStatus recreate_model(Instance *);
ModelStatus begin_model(Instance *);
fmi3Status refresh_outputs(Instance *);

/* fmi3_variables.c */
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

#endif
