/* Inside the shell: an instance, and the table of its variables, which the generated variables.c
 * fills. Units include only fmi3_model.h. */
#ifndef FMI3_INSTANCE_H
#define FMI3_INSTANCE_H
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

#endif
