/* Saved state: a header, then the arrays of `Waiting` and `Receptions` as they are. The byte order
 * is the host's (all targets are little-endian). */
#include "buffer.h"
#include "channel.h"
#include <string.h>

typedef struct {
    char magic[4];
    uint32_t version;
    int64_t highest_vehicle;
    uint64_t waiting, known, on_air; /* number of elements */
} Header;

static size_t size_of(const Header *h) {
    return sizeof *h + h->waiting * sizeof(Transmission) + h->known * sizeof(int64_t)
        + h->on_air * sizeof(Reception);
}

static uint8_t *put(uint8_t *to, const void *from, size_t size) {
    if (size > 0) memcpy(to, from, size);
    return to + size;
}

static const uint8_t *get(void *to, const uint8_t *from, size_t size) {
    if (size > 0) memcpy(to, from, size);
    return from + size;
}

size_t state_save(const Channel *c, uint8_t *bytes) {
    Header head = {{'C', 'H', 'N', 'L'}, 1, c->waiting.highest_vehicle, c->waiting.count, c->waiting.known_count,
                   c->on_air.count};
    if (bytes) {
        bytes = put(bytes, &head, sizeof head);
        bytes = put(bytes, c->waiting.item, head.waiting * sizeof(Transmission));
        bytes = put(bytes, c->waiting.known, head.known * sizeof(int64_t));
        put(bytes, c->on_air.item, head.on_air * sizeof(Reception));
    }
    return size_of(&head);
}

/* Whether every saved frame and reception can be used without further checks. */
static bool is_sound(const Channel *c) {
    for (size_t k = 0; k < c->waiting.count; k++) {
        const Transmission *t = &c->waiting.item[k];
        if (t->hop < 0 || t->hop > packet_relays(&t->packet)) return false;
        if (k > 0 && t->time > c->waiting.item[k - 1].time) return false;
        if (t->packet.size > FRAME_SIZE_MAX || t->packet.access_category > 3) return false;
    }
    for (size_t k = 0; k < c->on_air.count; k++)
        if (c->on_air.item[k].outcome > LOST_WEAK || c->on_air.item[k].link > NLOSB) return false;
    return true;
}

static ModelStatus not_a_state(Instance *i, Channel *c) {
    c->waiting.count = c->waiting.known_count = c->on_air.count = 0;
    return model_log(i, MODEL_ERROR, "these bytes are no saved state of a channel");
}

ModelStatus state_load(Instance *i, Channel *c, const uint8_t *bytes, size_t size) {
    Header head;
    if (size < sizeof head) return not_a_state(i, c);
    bytes = get(&head, bytes, sizeof head);
    if (memcmp(head.magic, "CHNL", 4) != 0 || head.version != 1 || head.waiting > size
        || head.known > size || head.on_air > size || size_of(&head) != size)
        return not_a_state(i, c);
    Waiting *w = &c->waiting;
    if (BUFFER_RESERVE(w->item, w->capacity, head.waiting)
        || BUFFER_RESERVE(w->known, w->known_capacity, head.known)
        || BUFFER_RESERVE(c->on_air.item, c->on_air.capacity, head.on_air))
        return model_log(i, MODEL_ERROR, "memory is short for the saved state");
    bytes = get(w->item, bytes, head.waiting * sizeof(Transmission));
    bytes = get(w->known, bytes, head.known * sizeof(int64_t));
    get(c->on_air.item, bytes, head.on_air * sizeof(Reception));
    w->highest_vehicle = head.highest_vehicle;
    w->count = head.waiting;
    w->known_count = head.known;
    c->on_air.count = head.on_air;
    c->scene.is_stale = true;
    return is_sound(c) ? MODEL_OK : not_a_state(i, c);
}
