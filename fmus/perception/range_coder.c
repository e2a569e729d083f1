#include "range_coder.h"

enum {
    ONE = 1 << 16, /* the share that is certainty */
    SLOWEST = 32,  /* part of its error by which a share changes at least, once it has learnt */
    TOP = 24,
};

void decisions_reset(Decision *decisions, size_t count) {
    for (size_t i = 0; i < count; i++) decisions[i] = (Decision){ONE / 2, 2};
}

static void learn(Decision *about, int yes) {
    if (yes) about->share += (uint16_t)((ONE - about->share) / about->inertia);
    else about->share -= about->share / about->inertia;
    if (about->inertia < SLOWEST) about->inertia++;
}

/* What is read beyond the end does not matter: it is noticed. */
static uint32_t byte_at(const Coder *coder, size_t place) {
    return place < coder->size ? coder->in[place] : 0;
}

static void put(Coder *coder, uint32_t byte) {
    if (coder->done < coder->size) coder->out[coder->done] = (uint8_t)byte;
    coder->done++;
}

Coder coder_for_writing(uint8_t *out, size_t capacity) {
    return (Coder){.high = UINT32_MAX, .size = capacity, .out = out};
}

Coder coder_for_reading(const uint8_t *in, size_t size) {
    Coder coder = {.high = UINT32_MAX, .size = size, .in = in};
    for (size_t i = 0; i < sizeof coder.value; i++)
        coder.value = coder.value << 8 | byte_at(&coder, i);
    return coder;
}

int decide(Coder *coder, Decision *about, int yes) {
    uint32_t range = coder->high - coder->low;
    uint32_t middle = coder->low + (uint32_t)((uint64_t)range * about->share >> 16);
    if (coder->in) yes = coder->value <= middle;
    if (yes) coder->high = middle;
    else coder->low = middle + 1;
    learn(about, yes);
    while ((coder->low ^ coder->high) >> TOP == 0) {
        if (coder->in) {
            coder->value = coder->value << 8 | byte_at(coder, coder->done + sizeof coder->value);
            coder->done++;
        } else put(coder, coder->low >> TOP);
        coder->low <<= 8;
        coder->high = coder->high << 8 | 255;
    }
    return yes;
}

uint32_t decide_byte(Coder *coder, ByteDecisions *about, uint32_t byte, uint32_t most) {
    uint32_t node = 1; /* the bits so far, after a 1 */
    for (int bit = 7; bit >= 0; bit--) {
        uint32_t smallest = ((2 * node + 1) << bit) - 256; /* if the bit is set */
        int is_set = smallest <= most && decide(coder, &about->bits[node], byte >> bit & 1);
        node = 2 * node + (is_set ? 1 : 0);
    }
    return node - 256;
}

int coder_is_exhausted(const Coder *coder) { return coder->done >= coder->size; }

/* The fewest bytes after which the number is in its interval whatever follows, so that no code
 * begins with another one; of those the lowest. Returns how many; they are the upper ones. */
static size_t last_bytes(const Coder *coder, uint32_t *bytes) {
    for (size_t n = 1;; n++) {
        uint64_t step = (uint64_t)1 << (32 - 8 * n);
        uint64_t first = (coder->low + step - 1) / step * step;
        if (first + step - 1 > coder->high) continue; /* fits at the latest with a step of 1 */
        *bytes = (uint32_t)first;
        return n;
    }
}

size_t coder_finish_writing(Coder *coder) {
    uint32_t bytes;
    for (size_t n = last_bytes(coder, &bytes); n > 0; n--, bytes <<= 8) put(coder, bytes >> TOP);
    return coder->done <= coder->size ? coder->done : 0;
}

int coder_finish_reading(const Coder *coder, Problem *problem) {
    uint32_t expected;
    size_t end = coder->done + last_bytes(coder, &expected);
    if (coder->size < end) return fail(problem, "a compressed APM is cut short");
    if (coder->size > end)
        return fail(problem, "a compressed APM has %zu bytes too many", coder->size - end);
    if (coder->value != expected) /* it ends in zeros */
        return fail(problem, "a compressed APM ends in other bytes than its cells make");
    return 0;
}
