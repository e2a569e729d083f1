#include "radios.h"
#include "buffer.h"
#include <string.h>

static Radio new_radio(int64_t vehicle, int64_t now) {
    Radio r = {
        .vehicle = vehicle,
        .is_idle = true,
        .idle_since = now,
        .busy_since = now,
        .entered = now,
        .contention_ends = NEVER,
        .sending_from = NEVER,
        .sending_until = NEVER,
        .locked = NO_FRAME,
    };
    for (int k = 0; k < CATEGORIES; k++)
        r.category[k] = (Category){EMPTY_QUEUE, 0, ACCESS_RULES[k].smallest};
    return r;
}

/* Hand over what waits in a radio. */
static int empty(Radios *s, Radio *r, Waiting *gone) {
    if (radio_is_sending(r) && r->sending_until == NEVER && waiting_add(gone, &r->sending)) return 1;
    for (int k = 0; k < CATEGORIES; k++)
        while (r->category[k].queue.count > 0) {
            Transmission t = queue_take(&s->store, &r->category[k].queue);
            if (waiting_add(gone, &t)) return 1;
        }
    return 0;
}

static bool fits(const Radios *s, const Scene *scene) {
    if (s->count != scene->count) return false;
    for (size_t k = 0; k < s->count; k++)
        if (s->item[k].vehicle != scene->id[k] || s->item[k].is_equipped != scene->equipped[k])
            return false;
    return true;
}

int radios_follow(Radios *s, const Scene *scene, int64_t now, Waiting *gone) {
    if (BUFFER_RESERVE(s->moved, s->moved_capacity, s->count)) return 1;
    for (size_t k = 0; k < s->count; k++) s->moved[k] = (uint32_t)k;
    if (fits(s, scene)) return 0;
    size_t before = s->count, old = 0;
    if (BUFFER_RESERVE(s->before, s->before_capacity, before)
        || BUFFER_RESERVE(s->item, s->capacity, scene->count))
        return 1;
    if (before > 0) memcpy(s->before, s->item, before * sizeof *s->item);
    s->count = scene->count;
    for (size_t k = 0; k < s->count; k++) { /* both are in the order of their vehicles */
        for (; old < before && s->before[old].vehicle < scene->id[k]; old++) {
            s->moved[old] = NO_RADIO;
            if (empty(s, &s->before[old], gone)) return 1;
        }
        s->item[k] = new_radio(scene->id[k], now);
        s->item[k].is_equipped = scene->equipped[k];
        if (old == before || s->before[old].vehicle != scene->id[k]) continue;
        if (s->before[old].is_equipped && scene->equipped[k]) {
            s->item[k] = s->before[old];
            s->moved[old] = (uint32_t)k;
        } else {
            s->moved[old] = NO_RADIO;
            if (empty(s, &s->before[old], gone)) return 1;
        }
        old++;
    }
    for (; old < before; old++) {
        s->moved[old] = NO_RADIO;
        if (empty(s, &s->before[old], gone)) return 1;
    }
    return 0;
}

void radios_free(Radios *s) {
    free(s->item);
    free(s->before);
    free(s->moved);
    queues_free(&s->store);
    *s = (Radios){0};
}
