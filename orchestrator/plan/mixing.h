/* Inputs that are made of outputs, as `orchestrator/algorithm/mixing.py` makes them, to the last bit: elements,
 * arithmetic in double, each operation rounded, sums from left to right, delays, sample and hold. */
#ifndef MIXING_H
#define MIXING_H

#include "numbers.h"

/* Element types of signals; plan/layouts.py has the same numbers. */
typedef enum { INT8, UINT8, INT16, UINT16, INT32, UINT32, INT64, UINT64, FLOAT, DOUBLE, BOOL } Type;

/* As `orchestrator.operation.Kind`. */
enum { MULTIPLY, DIVIDE, ADD };

typedef struct {
    int32_t kind, pad;
    double number;
} Operation;

/* What one output showed lately: value number n, counted from 0, lies in row n % rows. */
typedef struct {
    Source source;
    int64_t *time; /* when it was published [ns] */
    uint8_t *row;
    size_t size; /* of a value [byte] */
    uint64_t rows, count;
} Past;

typedef struct {
    Source source;
    Past *past;           /* NULL: what it shows now */
    int64_t delay;        /* [ns] */
    int64_t sample;       /* [ns]; 0: whenever the target reads */
    uint8_t *held;        /* the value that was sampled last */
    int64_t held_from;    /* when [ns] */
    uint64_t held_number; /* which value that is, counted from 1; 0: none */
    uint64_t at;          /* a value of the past that is not too new */
    uint64_t seen;        /* which value was used last */
    const uint8_t *value; /* what it reads; NULL: there is nothing yet */
    const int64_t *index; /* the elements that are read; NULL: all */
    size_t count;
    const Operation *operation;
    size_t operations;
    int32_t type, pad;
} Term;

typedef struct {
    Term *term; /* their sum */
    size_t terms;
    const int64_t *place; /* the elements that are driven; NULL: all */
    size_t count;
} Part;

typedef struct {
    Part *part;
    size_t parts;
    size_t count;        /* elements */
    const double *start; /* of a floating-point input: as its other elements stay */
    double *made, *sum, *value; /* of `count` elements each */
    const uint8_t *rest; /* of any other input */
    uint8_t *input;      /* what it becomes */
    size_t size;         /* of that [byte] */
    uint64_t version;    /* counts what it became */
    int32_t type, is_new;
} Mix;

/* ---- which value ---- */
APART static void note(Past *p, int64_t now) {
    size_t k = (size_t)(p->count++ % p->rows);
    p->time[k] = now;
    copy(p->row + k * p->size, seen_at(&p->source), p->size);
}

/* The number of the last value up to `t`, counted from 1; 0: there is none. Later calls have no earlier `t`. */
static uint64_t number_at(Term *m, int64_t t) {
    const Past *p = m->past;
    uint64_t oldest = p->count > p->rows ? p->count - p->rows : 0;
    if (m->at < oldest) m->at = oldest;
    if (p->count == 0 || p->time[m->at % p->rows] > t) return 0;
    while (m->at + 1 < p->count && p->time[(m->at + 1) % p->rows] <= t) m->at++;
    return m->at + 1;
}

static const uint8_t *row_of(const Past *p, uint64_t number) {
    return p->row + (size_t)((number - 1) % p->rows) * p->size;
}

/* What a term reads at `now`, NULL before there is anything; `number` says which value that is. */
static const uint8_t *read_term(Term *m, int64_t now, int64_t start, uint64_t *number) {
    if (!m->past) {
        *number = *m->source.version;
        return seen_at(&m->source);
    }
    if (!m->sample) {
        *number = number_at(m, now - m->delay);
        return *number ? row_of(m->past, *number) : NULL;
    }
    int64_t due = now - (now - start) % m->sample;
    if (!m->held_number || due != m->held_from || due == now) {
        m->held_number = number_at(m, due - m->delay);
        m->held_from = due;
        if (m->held_number) copy(m->held, row_of(m->past, m->held_number), m->past->size);
    }
    *number = m->held_number;
    return m->held_number ? m->held : NULL;
}

/* ---- what becomes of it ---- */
#define EACH_TYPE(X)                                                                                        \
    X(INT8, int8_t) X(UINT8, uint8_t) X(INT16, int16_t) X(UINT16, uint16_t) X(INT32, int32_t)                \
    X(UINT32, uint32_t) X(INT64, int64_t) X(UINT64, uint64_t) X(FLOAT, float) X(DOUBLE, double) X(BOOL, uint8_t)

static void as_doubles(const Term *m, const void *from, double *to) {
#define CASE(TYPE, type)                                                                              \
    case TYPE:                                                                                        \
        for (size_t k = 0; k < m->count; k++)                                                         \
            to[k] = (double)((const type *)from)[m->index ? (size_t)m->index[k] : k];                 \
        break;
    switch ((Type)m->type) { EACH_TYPE(CASE) }
#undef CASE
}

/* Whole numbers and Booleans; the type of the input holds all of the source's values. */
static void as_whole(const Term *m, const Part *part, const void *from, Type type, void *to) {
    for (size_t k = 0; k < part->count; k++) {
        size_t i = m->index ? (size_t)m->index[k] : k, place = part->place ? (size_t)part->place[k] : k;
        uint64_t bits = 0;
#define READ(TYPE, type) \
    case TYPE: bits = (uint64_t)((const type *)from)[i]; break;
#define WRITE(TYPE, type) \
    case TYPE: ((type *)to)[place] = (type)bits; break;
        switch ((Type)m->type) { EACH_TYPE(READ) }
        switch (type) { EACH_TYPE(WRITE) }
#undef READ
#undef WRITE
    }
}

static void operate(const Term *m, double *value) {
    for (size_t n = 0; n < m->operations; n++) {
        double number = m->operation[n].number;
        switch (m->operation[n].kind) {
        case MULTIPLY:
            for (size_t k = 0; k < m->count; k++) value[k] *= number;
            break;
        case DIVIDE:
            for (size_t k = 0; k < m->count; k++) value[k] /= number;
            break;
        default:
            for (size_t k = 0; k < m->count; k++) value[k] += number;
        }
    }
}

/* The sum of a part into the elements that it drives. */
static void add_up(Mix *x, const Part *part) {
    for (size_t n = 0; n < part->terms; n++) {
        double *value = n == 0 ? x->sum : x->value;
        as_doubles(&part->term[n], part->term[n].value, value);
        operate(&part->term[n], value);
        for (size_t k = 0; n > 0 && k < part->count; k++) x->sum[k] += value[k];
    }
    for (size_t k = 0; k < part->count; k++) x->made[part->place ? (size_t)part->place[k] : k] = x->sum[k];
}

/* Whether the input is finite. */
static bool finish(Mix *x) {
    if (x->type == DOUBLE) {
        copy(x->input, x->made, x->count * sizeof *x->made);
        return are_finite64(x->made, x->count);
    }
    if (x->type == FLOAT) {
        float *input = (float *)x->input;
        for (size_t k = 0; k < x->count; k++) input[k] = (float)x->made[k];
        return are_finite32(input, x->count);
    }
    return true;
}

static bool is_there(const Part *part) {
    for (size_t n = 0; n < part->terms; n++)
        if (!part->term[n].value) return false;
    return true;
}

/* Bring an input up to date at `now`, in a run from `start`; false if it is not finite. */
APART static bool mix(Mix *x, int64_t now, int64_t start) {
    bool is_new = x->is_new, is_float = x->type == DOUBLE || x->type == FLOAT;
    for (size_t k = 0; k < x->parts; k++)
        for (size_t n = 0; n < x->part[k].terms; n++) {
            Term *m = &x->part[k].term[n];
            uint64_t before = m->seen;
            m->value = read_term(m, now, start, &m->seen);
            is_new |= m->seen != before;
        }
    if (!is_new) return true;
    x->is_new = false;
    x->version++;
    if (is_float) copy(x->made, x->start, x->count * sizeof *x->made);
    else copy(x->input, x->rest, x->size);
    for (size_t k = 0; k < x->parts; k++) {
        const Part *part = &x->part[k];
        if (!is_there(part)) continue;
        if (is_float) add_up(x, part);
        else as_whole(part->term, part, part->term->value, (Type)x->type, x->input);
    }
    return finish(x);
}

#endif
