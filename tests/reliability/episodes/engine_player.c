/* Plays episodes of the engine that steps FMUs: plans of any shape whose FMUs answer what they like: numbers that are
 * none, Booleans of any byte, bytes of any size, texts that are none, any status.
 *
 *     engine_player < seeds > what_became_of_them
 *
 * It is fed and answers like player.c; instead of calls an episode has a seed of 8 bytes. Under sanitizers every read
 * and write beyond a value is noticed, as each value has a block of its own size. What is checked besides: that the
 * engine comes back at its points and with its outcomes, and records no number that is not finite. */
#include <math.h>
#include <stdio.h>

#include "engine.c"

enum { UNITS = 4, KINDS = 6, MOST = 200, REFERENCES = 3 };

static const size_t SIZE_OF[KINDS] = {4, 4, 8, 1, 1, 0}; /* in a signal: PLAIN, FLOAT32, FLOAT64, two Booleans, BINARY */

/* ---- chance (a linear congruential generator) ---- */
static uint64_t chance_state;
static uint32_t any(uint32_t below) {
    chance_state = chance_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(((chance_state >> 32) * below) >> 32);
}
static bool happens(uint32_t one_of) { return any(one_of) == 0; }

static double any_number(void) {
    static const double STRANGE[] = {NAN, INFINITY, -INFINITY};
    static const double LARGE[] = {0, -0.0, 1e308, -1e308, 5e-324, 1};
    if (happens(400)) return STRANGE[any(3)];
    return happens(3) ? LARGE[any(6)] : any(1000) / 7.0 - 50;
}

static float any_float(void) {
    double number = any_number();
    return (float)(isfinite(number) ? fmax(fmin(number, 1e38), -1e38) : number);
}

/* ---- memory, which is given back at the end of an episode ---- */
static void *given[4096];
static size_t gifts;
static void *room(size_t size) {
    void *memory = calloc(1, size ? size : 1);
    if (!memory || gifts == sizeof given / sizeof *given) exit(7);
    return given[gifts++] = memory;
}

/* ---- FMUs ---- */
typedef struct {
    size_t count[KINDS]; /* elements of its outputs, by kind; of BINARY and TEXT, values */
    uint8_t *value[REFERENCES]; /* bytes that it showed last */
    uint64_t sum; /* of what was set */
    uint32_t unsound; /* one of so many calls fails */
} Fake;

static int any_status(const Fake *f) {
    static const int STATUS[] = {1, 2, 3, 4, 5, -1, 99};
    return happens(f->unsound) ? STATUS[any(7)] : happens(30) ? STATUS_WARNING : STATUS_OK;
}

static void fill(const Fake *f, uint32_t kind, void *values) {
    for (size_t k = 0; k < f->count[kind]; k++) switch (kind) {
        case PLAIN: ((int32_t *)values)[k] = (int32_t)any(UINT32_MAX); break;
        case FLOAT32: ((float *)values)[k] = any_float(); break;
        case FLOAT64: ((double *)values)[k] = any_number(); break;
        case BOOLEAN8: ((uint8_t *)values)[k] = (uint8_t)any(256); break;
        default: ((int32_t *)values)[k] = (int32_t)any(3) - 1; break;
    }
}
static int get2(void *c, const uint32_t *reference, size_t n, void *values) {
    (void)n;
    fill(c, *reference, values);
    return any_status(c);
}
static int get3(void *c, const uint32_t *reference, size_t n, void *values, size_t count) {
    if (count != ((Fake *)c)->count[*reference]) abort();
    return get2(c, reference, n, values);
}
static int get_bytes(void *c, const uint32_t *reference, size_t n, size_t *sizes, const uint8_t **data, size_t count) {
    Fake *f = c;
    (void)reference, (void)count;
    for (size_t k = 0; k < n; k++) {
        sizes[k] = happens(4) ? 0 : any(300);
        free(f->value[k]);
        f->value[k] = malloc(sizes[k] ? sizes[k] : 1);
        if (!f->value[k]) exit(7);
        for (size_t i = 0; i < sizes[k]; i++) f->value[k][i] = (uint8_t)any(256);
        data[k] = happens(20) ? NULL : f->value[k];
    }
    return any_status(f);
}
static int get_texts(void *c, const uint32_t *reference, size_t n, const void *values, size_t count) {
    static const char *const TEXTS[] = {"", "plain", "\xc3\xa9", "\xf0\x9f\x9a\x97", "\xff", "\xc3", "\xed\xa0\x80"};
    (void)reference, (void)count;
    for (size_t k = 0; k < n; k++) ((const char **)values)[k] = happens(20) ? NULL : TEXTS[any(happens(40) ? 7 : 4)];
    return any_status(c);
}
static int set2(void *c, const uint32_t *reference, size_t n, const void *values) {
    Fake *f = c;
    (void)n;
    for (size_t k = 0; k < *reference; k++) f->sum += ((const uint8_t *)values)[k]; /* so many bytes there are */
    return any_status(f);
}
static int set3(void *c, const uint32_t *reference, size_t n, const void *values, size_t count) {
    (void)count;
    return set2(c, reference, n, values);
}
static int set_bytes(void *c, const uint32_t *reference, size_t n, const size_t *size, const uint8_t *const *data, size_t m) {
    Fake *f = c;
    (void)reference, (void)m;
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < size[k]; i++) f->sum += data[k][i];
    return any_status(f);
}
static int step2(void *c, double t, double h, int keeps) { return (void)t, (void)keeps, h > 0 ? any_status(c) : 3; }
static int step3(void *c, double t, double h, bool keeps, bool *event, bool *end, bool *early, double *last) {
    *event = happens(50), *end = happens(300), *early = happens(300);
    *last = happens(50) ? any_number() : t + h;
    return step2(c, t, h, keeps);
}
static int attend(int status, int64_t from) {
    (void)from;
    return status > 4 || happens(4) ? HAS_FAILED : (int)any(3);
}

/* ---- plans ---- */
static const uint32_t *reference_of(uint32_t number) {
    uint32_t *reference = room(sizeof *reference * REFERENCES);
    reference[0] = number;
    return reference;
}

static size_t aligned(size_t size) { return (size + 7) / 8 * 8; }

/* The outputs of a unit, one getting for each kind that it has. */
static void give_outputs(Unit *u, Fake *f, bool is_parallel) {
    size_t at = 0;
    u->getting = room((KINDS + 1) * sizeof *u->getting);
    for (uint32_t kind = PLAIN; kind <= BINARY; kind++) {
        f->count[kind] = kind == BINARY ? 1 + any(2) : happens(3) ? 0 : 1 + any(20);
        if (f->count[kind] == 0) continue;
        Getting *g = &u->getting[u->gettings++];
        *g = (Getting){.function = u->version == 2 ? (void *)get2 : (void *)get3, .reference = reference_of(kind),
                       .references = 1, .count = f->count[kind], .kind = (int32_t)kind, .signal = at};
        if (kind == BOOLEAN8 || kind == BOOLEAN32) g->elements = room(f->count[kind] * (kind == BOOLEAN8 ? 1 : 4));
        if (kind == BINARY) {
            g->kind = happens(2) && u->version == 3 ? TEXT : BINARY;
            g->function = g->kind == TEXT ? (void *)get_texts : (void *)get_bytes;
            g->is_binary = 1, g->references = f->count[kind], g->signal = 0;
            g->sizes = room(g->references * sizeof *g->sizes);
            g->pointers = room(g->references * sizeof *g->pointers);
        }
        at = aligned(at + f->count[kind] * SIZE_OF[kind]);
    }
    u->size = at;
    u->pending = room(at), u->published = is_parallel ? room(at) : u->pending;
    u->pending_bytes = room(f->count[BINARY] * sizeof(Bytes));
    u->published_bytes = is_parallel ? room(f->count[BINARY] * sizeof(Bytes)) : u->pending_bytes;
}

static const Getting *getting_of(const Unit *u, int32_t kind) {
    for (size_t k = 0; k < u->gettings; k++)
        if (u->getting[k].kind == kind) return &u->getting[k];
    return NULL;
}

static Source source_of(Unit *u, const Getting *g) {
    return (Source){(const uint8_t *const *)(g->is_binary ? &u->published_bytes : &u->published), g->signal,
                    &u->publications};
}

static void record_outputs(Unit *u) {
    u->track = room((KINDS + 1) * sizeof *u->track);
    for (size_t k = 0; k < u->gettings; k++) {
        const Getting *g = &u->getting[k];
        if (happens(3)) continue;
        size_t size = g->is_binary ? 8 : g->count * SIZE_OF[g->kind];
        u->track[u->tracks++] = (Track){.from = g->signal, .size = size, .row = room(size * MOST), .is_binary = g->is_binary};
    }
    if (happens(2)) u->shelf = room(SHELF * u->size);
}

/* What a unit reads as it is: an output of another one. */
static void connect_as_it_is(Unit *u, Unit *other) {
    const Getting *g = other->gettings ? &other->getting[any((uint32_t)other->gettings)] : NULL;
    if (!g) return;
    Setting *s = &u->setting[u->settings++];
    Copy *copies = room(sizeof *copies);
    *s = (Setting){.references = 1, .kind = g->kind, .is_binary = g->is_binary, .copy = copies, .copies = 1,
                   .count = g->count, .function = u->version == 2 ? (void *)set2 : (void *)set3};
    copies->from = source_of(other, g);
    copies->seen = UINT64_MAX;
    if (g->is_binary) {
        s->kind = BINARY; /* bytes of a text are bytes */
        s->function = (void *)set_bytes;
        s->elements = room(2 * sizeof(size_t));
        s->reference = reference_of(0);
        return;
    }
    copies->size = g->kind == BOOLEAN32 ? g->count : g->count * SIZE_OF[g->kind];
    if (g->kind == BOOLEAN32 || happens(2)) s->elements = copies->to = room(g->count * (g->kind == BOOLEAN32 ? 4 : SIZE_OF[g->kind]));
    s->reference = reference_of((uint32_t)(g->count * (g->kind == BOOLEAN32 ? 4 : SIZE_OF[g->kind])));
}

static Past *past_of(Unit *u, const Getting *g) {
    Past *p = room(sizeof *p);
    *p = (Past){.source = source_of(u, g), .size = g->count * 8, .rows = 1 + any(8)};
    p->time = room(p->rows * sizeof *p->time), p->row = room(p->rows * p->size);
    u->past[u->pasts++] = p;
    return p;
}

static void operate_somehow(Term *m) {
    static const double NUMBERS[] = {0, 1, -2.5, 1e300, 1e-300};
    Operation *operation = room(3 * sizeof *operation);
    m->operations = any(4), m->operation = operation;
    for (size_t k = 0; k < m->operations; k++) operation[k] = (Operation){(int32_t)any(3), 0, NUMBERS[any(happens(9) ? 5 : 3)]};
}

/* An input that is made of an output of another unit: elements, arithmetic, the past. */
static void connect_by_mixing(Unit *u, Unit *other) {
    const Getting *g = getting_of(other, FLOAT64);
    if (!g) return;
    size_t count = 1 + any(6);
    Mix *x = &u->mix[u->mixes++];
    double *start = room(count * 8);
    int64_t *index = room(count * 8);
    Term *term = room(2 * sizeof *term);
    Part *part = room(sizeof *part);
    for (size_t k = 0; k < count; k++) index[k] = any((uint32_t)g->count);
    *part = (Part){.term = term, .terms = 1 + any(2), .count = count};
    for (size_t k = 0; k < part->terms; k++) {
        term[k] = (Term){.source = source_of(other, g), .index = index, .count = count, .type = DOUBLE};
        operate_somehow(&term[k]);
        if (happens(2) || other->pasts == UNITS) continue;
        term[k].past = past_of(other, g);
        term[k].delay = any(4) * 7000000LL, term[k].sample = any(2) * 25000000LL;
        term[k].held = room(g->count * 8);
    }
    bool is_float = happens(4);
    *x = (Mix){.part = part, .parts = 1, .count = count, .start = start, .made = room(count * 8), .sum = room(count * 8),
               .value = room(count * 8), .rest = room(count * 8), .input = room(count * 8), .is_new = 1,
               .size = count * (is_float ? 4 : 8), .type = is_float ? FLOAT : DOUBLE};
}

static Unit *make_units(Plan *p, Fake *fakes) {
    Unit *units = room(p->units * sizeof *units);
    bool *flags = room(3 * p->units);
    for (size_t k = 0; k < p->units; k++) {
        Unit *u = &units[k];
        int64_t denominator = happens(3) ? 1 + any(9) : 1;
        u->version = happens(3) ? 2 : 3;
        u->instance = &fakes[k], u->step = u->version == 2 ? (void *)step2 : (void *)step3;
        fakes[k] = (Fake){.unsound = happens(2) ? 1000000 : 200};
        u->grid = (Grid){p->start, (1 + any(30)) * 1000000LL, denominator};
        u->attend = attend, u->last_time = room(8);
        for (int i = 0; i < 3; i++) u->flag[i] = flags + 3 * k + i;
        u->past = room(UNITS * UNITS * sizeof *u->past);
        u->setting = room(UNITS * sizeof *u->setting), u->mix = room(UNITS * sizeof *u->mix);
        give_outputs(u, &fakes[k], p->is_parallel);
        record_outputs(u);
    }
    for (size_t k = 0; k < p->units; k++)
        for (size_t n = any(3); n > 0; n--) {
            connect_as_it_is(&units[k], &units[any((uint32_t)p->units)]);
            if (happens(2)) connect_by_mixing(&units[k], &units[any((uint32_t)p->units)]);
        }
    return units;
}

/* ---- an episode ---- */
static uint32_t number, wrong;
static void expect(bool holds, const char *what) {
    if (holds) return;
    printf("wrong %u: %s\n", number, what);
    wrong++;
}

static void check_records(const Plan *p) {
    for (size_t k = 0; k < p->units; k++) {
        const Unit *u = &p->unit[k];
        expect(u->rows <= p->points + 1, "a unit has more rows than there were points");
        for (size_t i = 0; i < u->tracks; i++) {
            const Track *r = &u->track[i];
            const Getting *g = getting_of(u, FLOAT64), *f = getting_of(u, FLOAT32);
            if (g && !r->is_binary && r->from == g->signal && r->size == g->count * 8)
                for (size_t n = 0; n < u->rows * g->count; n++)
                    expect(isfinite(((double *)(void *)r->row)[n]), "a recorded number is not finite");
            if (f && !r->is_binary && r->from == f->signal && r->size == f->count * 4)
                for (size_t n = 0; n < u->rows * f->count; n++)
                    expect(isfinite(((float *)(void *)r->row)[n]), "a recorded number is not finite");
            int64_t bytes = 0;
            for (size_t n = 0; r->is_binary && n < u->rows; n++) bytes += ((int64_t *)(void *)r->row)[n];
            expect(!r->is_binary || bytes == (int64_t)r->bytes.size, "recorded bytes and their sizes disagree");
        }
    }
}

static uint32_t play(void) {
    Fake fakes[UNITS];
    Plan *p = room(sizeof *p); /* so that a byte beyond it is noticed */
    *p = (Plan){.units = 1 + any(UNITS), .is_parallel = happens(2), .start = any(3) * 1000000000LL};
    p->unit = make_units(p, fakes);
    p->now = p->start;
    uint32_t points = 0;
    for (int stretch = 0; stretch < 3; stretch++) {
        p->points = 0, p->end = p->now + any(400) * 10000000LL;
        int64_t before = p->now;
        int outcome = HAS_PAUSED;
        while (outcome == HAS_PAUSED && p->points < MOST) {
            p->most = p->points + 1 + any((uint32_t)(MOST - p->points));
            outcome = plan_run(p);
            expect(outcome >= ALL_DONE && outcome <= HAS_PAUSED, "an outcome that there is not");
            expect(p->points <= p->most && p->now >= before, "points that there are not");
            expect(outcome != HAS_PAUSED || p->points == p->most, "a pause too early");
            check_records(p);
        }
        points += (uint32_t)p->points;
        if (outcome != ALL_DONE && outcome != HAS_PAUSED) break;
    }
    for (size_t k = 0; k < p->units; k++) {
        Unit *u = &p->unit[k];
        for (size_t i = 0; i < fakes[k].count[BINARY]; i++) {
            plan_release((Bytes *)(void *)u->pending_bytes + i);
            if (p->is_parallel) plan_release((Bytes *)(void *)u->published_bytes + i);
        }
        for (size_t i = 0; i < u->tracks; i++) plan_release(&u->track[i].bytes);
        for (int i = 0; i < REFERENCES; i++) free(fakes[k].value[i]);
    }
    return points;
}

size_t __sanitizer_get_current_allocated_bytes(void) __attribute__((weak));
static size_t memory(void) {
    return __sanitizer_get_current_allocated_bytes ? __sanitizer_get_current_allocated_bytes() : 0;
}

int main(void) {
    static char line[1 << 16];
    struct { uint32_t number, calls; uint64_t seed; } episode;
    setvbuf(stdout, line, _IOLBF, sizeof line);
    while (fread(&episode, sizeof episode, 1, stdin) == 1) {
        number = episode.number, wrong = 0, gifts = 0;
        chance_state = episode.seed * 0x9E3779B97F4A7C15u + number;
        for (int k = 0; k < 9; k++) any(2); /* neighbouring seeds begin alike */
        size_t before = memory();
        double from = clock_ns();
        uint32_t points = play();
        while (gifts > 0) free(given[--gifts]);
        expect(memory() <= before, "memory is left");
        printf("end %u calls 1 refused 0 advances %u wrong %u milliseconds %.0f\n", number, points, wrong,
               (clock_ns() - from) * 1e-6);
    }
    return 0;
}
