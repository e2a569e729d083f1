#include "medium_access.h"
#include "random.h"

static void draw_backoff(Radio *r, Category *c, uint64_t seed) {
    Uniforms u = draw(seed, DRAW_BACKOFF, (int64_t)r->backoffs++, 0, r->vehicle);
    c->backoff = (uint32_t)(u.first * (c->window + 1.0));
}

static bool is_contending(const Category *c) { return c->queue.count > 0; }

/* When a category may send, if the medium stays idle. A frame that comes when all waiting is over
 * goes out at the next slot boundary. */
static int64_t earliest_start(const Radio *r, int k, int64_t now) {
    const Category *c = &r->category[k];
    int64_t start = r->idle_since + ACCESS_RULES[k].aifs + (int64_t)c->backoff * SLOT;
    if (start >= now) return start;
    return start + ((now - start) / SLOT + 1) * SLOT;
}

static void contend(Radio *r, int64_t now) {
    int64_t first = NEVER;
    for (int k = 0; k < CATEGORIES; k++) {
        if (!is_contending(&r->category[k])) continue;
        int64_t start = earliest_start(r, k, now);
        if (start < first) first = start;
    }
    if (first == r->contention_ends) return;
    r->contention_ends = first;
    r->contention_stamp++;
}

/* The slot boundaries since the AIFS of a category was over, its end included. */
static uint64_t slots_gone(const Radio *r, int k, int64_t now) {
    int64_t waited = now - r->idle_since - ACCESS_RULES[k].aifs;
    return waited < 0 ? 0 : 1 + (uint64_t)waited / SLOT;
}

/* The categories whose backoff is over and that have a frame, as bits. */
static unsigned ready(const Radio *r, int64_t now) {
    unsigned over = 0;
    for (int k = 0; k < CATEGORIES; k++)
        if (is_contending(&r->category[k]) && slots_gone(r, k, now) > r->category[k].backoff)
            over |= 1u << k;
    return over;
}

/* Account for the slots since the medium became idle. */
static void count_down(Radio *r, int64_t now) {
    for (int k = 0; k < CATEGORIES; k++) {
        uint64_t gone = slots_gone(r, k, now);
        uint32_t *backoff = &r->category[k].backoff;
        *backoff -= gone < *backoff ? (uint32_t)gone : *backoff;
    }
}

static void suspend(Radio *r) {
    if (r->contention_ends == NEVER) return;
    r->contention_ends = NEVER;
    r->contention_stamp++;
}

void access_enqueued(Radio *r, AccessCategory k, uint64_t seed, int64_t now) {
    Category *c = &r->category[k];
    if (c->queue.count != 1) return; /* those before it decide */
    if (r->is_idle) contend(r, now);
    else if (c->backoff == 0) draw_backoff(r, c, seed);
}

void access_medium_busy(Radio *r, int64_t now) {
    uint32_t at_work = 0; /* most radios have nothing to count down */
    for (int k = 0; k < CATEGORIES; k++) at_work |= r->category[k].backoff | r->category[k].queue.count;
    if (at_work == 0) return;
    count_down(r, now);
    suspend(r);
}

void access_medium_idle(Radio *r, int64_t now) { contend(r, now); }

int access_contention_ended(Radio *r, uint64_t seed, int64_t now) {
    unsigned over = ready(r, now);
    suspend(r);
    if (over == 0) {
        contend(r, now);
        return CATEGORIES;
    }
    count_down(r, now);
    int winner = CATEGORIES;
    for (int k = CATEGORIES - 1; k >= 0; k--) {
        if (!(over & 1u << k)) continue;
        Category *c = &r->category[k];
        if (winner == CATEGORIES) {
            winner = k;
            continue;
        }
        c->window = 2 * c->window + 1 < ACCESS_RULES[k].largest ? 2 * c->window + 1 : ACCESS_RULES[k].largest;
        draw_backoff(r, c, seed);
    }
    return winner;
}

void access_sent(Radio *r, AccessCategory k, uint64_t seed) {
    Category *c = &r->category[k];
    c->window = ACCESS_RULES[k].smallest;
    draw_backoff(r, c, seed);
}
