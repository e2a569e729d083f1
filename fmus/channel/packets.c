#include "packets.h"
#include "buffer.h"
#include "clock.h"
#include "modulation.h"
#include "variables.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int64_t packet_relays(const Packet *p) {
    return p->route[0] == NO_VEHICLE ? 0 : p->route[1] == NO_VEHICLE ? 1 : 2;
}

int64_t packet_addressee(const Packet *p, int64_t hop) {
    return hop < packet_relays(p) ? p->route[hop] : p->destination;
}

static bool is_before(const Transmission *a, const Transmission *b) {
    if (a->time != b->time) return a->time < b->time;
    if (a->packet.id != b->packet.id) return a->packet.id < b->packet.id;
    return a->hop < b->hop;
}

/* The array is sorted so that the first frame stands last and is taken without moving others. */
int waiting_add(Waiting *w, const Transmission *added) {
    if (BUFFER_RESERVE(w->item, w->capacity, w->count + 1)) return 1;
    size_t low = 0, high = w->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (is_before(added, &w->item[middle])) low = middle + 1;
        else high = middle;
    }
    memmove(&w->item[low + 1], &w->item[low], (w->count - low) * sizeof *w->item);
    w->item[low] = *added;
    w->count++;
    return 0;
}

void waiting_free(Waiting *w) {
    free(w->item);
    free(w->known);
    free(w->incoming);
    *w = (Waiting){.highest_vehicle = -1};
}

static int compare_ids(const void *a, const void *b) {
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static bool is_known(const Waiting *w, int64_t id) {
    return w->known_count > 0
        && bsearch(&id, w->known, w->known_count, sizeof *w->known, compare_ids);
}

/* The head of the input, `count` 0 if it is empty. */
static ModelStatus read_head(Instance *i, const Binary *binary, Frame *head) {
    *head = (Frame){.count = 0};
    if (binary->size == 0) return MODEL_OK;
    if (binary->size < sizeof *head)
        return model_log(i, MODEL_ERROR, "packets: %zu bytes are too few for a frame of records",
                         binary->size);
    memcpy(head, binary->data, sizeof *head);
    if (memcmp(head->magic, "PKTS", 4) != 0 || head->version != 1)
        return model_log(i, MODEL_ERROR, "packets: not a `PKTS` frame of version 1");
    if (head->record_size != sizeof(Packet))
        return model_log(i, MODEL_ERROR, "packets: records have %zu bytes, not %u", sizeof(Packet),
                         (unsigned)head->record_size);
    if ((binary->size - sizeof *head) / sizeof(Packet) != head->count
        || (binary->size - sizeof *head) % sizeof(Packet) != 0)
        return model_log(i, MODEL_ERROR, "packets: a frame of %u records has %zu bytes, not %zu",
                         (unsigned)head->count, sizeof *head + (size_t)head->count * sizeof(Packet),
                         binary->size);
    return MODEL_OK;
}

static ModelStatus check_route(Instance *i, uint32_t k, const Packet *p) {
    const int64_t stop[] = {p->source, p->route[0], p->route[1], p->destination};
    if (p->route[0] == NO_VEHICLE && p->route[1] != NO_VEHICLE)
        return model_log(i, MODEL_ERROR, "packets[%u].route: the second relay without a first",
                         (unsigned)k);
    for (int a = 0; a < 4; a++) {
        if (stop[a] < NO_VEHICLE)
            return model_log(i, MODEL_ERROR, "packets[%u]: %lld is no vehicle", (unsigned)k,
                             (long long)stop[a]);
        for (int b = 0; b < a; b++)
            if (stop[a] != NO_VEHICLE && stop[a] == stop[b])
                return model_log(i, MODEL_ERROR,
                                 "packets[%u]: vehicle %lld stands twice on the way from source to "
                                 "destination", (unsigned)k, (long long)stop[a]);
    }
    return MODEL_OK;
}

static ModelStatus check_packet(Instance *i, const Waiting *w, const Scene *s, uint32_t mac_header,
                                uint32_t k, const Packet *p) {
    /* A source that has left meanwhile is no error; one that has never been there is. */
    size_t source = scene_find(s, p->source);
    if (p->source < 0 || p->source > w->highest_vehicle)
        return model_log(i, MODEL_ERROR, "packets[%u].source: there is no vehicle %lld", (unsigned)k,
                         (long long)p->source);
    if (source != NO_INDEX && !s->equipped[source])
        return model_log(i, MODEL_ERROR, "packets[%u].source: vehicle %lld is not equipped",
                         (unsigned)k, (long long)p->source);
    if ((uint64_t)p->size + mac_header > FRAME_SIZE_MAX)
        return model_log(i, MODEL_ERROR,
                         "packets[%u].size: %u bytes and %u of headers do not fit into one frame of "
                         "%u bytes; split the packet", (unsigned)k, (unsigned)p->size,
                         (unsigned)mac_header, FRAME_SIZE_MAX);
    const int64_t last = (int64_t)LAST_SECOND * 1000000000;
    if (p->time <= -last || p->time >= last)
        return model_log(i, MODEL_ERROR, "packets[%u].time is %lld ns; it must lie within %g s of 0",
                         (unsigned)k, (long long)p->time, LAST_SECOND);
    if (p->duration < 0 || p->duration > INT32_MAX)
        return model_log(i, MODEL_ERROR,
                         "packets[%u].duration is %lld ns; it must be 0 to 2147483647", (unsigned)k,
                         (long long)p->duration);
    if (!(fabs(p->power_offset) <= 300))
        return model_log(i, MODEL_ERROR,
                         "packets[%u].power_offset is %g dB; it must lie between -300 and 300",
                         (unsigned)k, p->power_offset);
    if (p->kind > NOISE)
        return model_log(i, MODEL_ERROR, "packets[%u].kind is %u; it must be 0 to %d", (unsigned)k,
                         (unsigned)p->kind, NOISE);
    if (p->kind == NOISE && p->duration == 0)
        return model_log(i, MODEL_ERROR, "packets[%u].duration is 0; noise needs a duration",
                         (unsigned)k);
    if (p->kind != NOISE && p->channel_offset != 0)
        return model_log(i, MODEL_ERROR,
                         "packets[%u].channel_offset is %d; only noise may lie beside the channel",
                         (unsigned)k, (int)p->channel_offset);
    if (p->access_category > 3)
        return model_log(i, MODEL_ERROR, "packets[%u].access_category is %u; it must be 0 to 3",
                         (unsigned)k, (unsigned)p->access_category);
    return check_route(i, k, p);
}

/* Make the ids of this input the known ones. */
static ModelStatus remember(Instance *i, Waiting *w, uint32_t count) {
    if (count > 0) qsort(w->incoming, count, sizeof *w->incoming, compare_ids);
    for (uint32_t k = 1; k < count; k++)
        if (w->incoming[k] == w->incoming[k - 1])
            return model_log(i, MODEL_ERROR, "packets: id %lld appears twice; ids are unique in a run",
                             (long long)w->incoming[k]);
    int64_t *known = w->known;
    size_t capacity = w->known_capacity;
    w->known = w->incoming, w->known_capacity = w->incoming_capacity, w->known_count = count;
    w->incoming = known, w->incoming_capacity = capacity;
    return MODEL_OK;
}

static Packet packet_at(const Binary *binary, uint32_t k) {
    Packet packet;
    memcpy(&packet, binary->data + sizeof(Frame) + k * sizeof packet, sizeof packet);
    return packet;
}

ModelStatus packets_accept(Instance *i, Waiting *w, const Scene *s, uint32_t mac_header, int64_t now) {
    if (s->count > 0 && s->id[s->count - 1] > w->highest_vehicle)
        w->highest_vehicle = s->id[s->count - 1];
    const Binary *binary = variable_binary(i, VR_packets);
    Frame head;
    ModelStatus status = read_head(i, binary, &head);
    if (status != MODEL_OK) return status;
    if (BUFFER_RESERVE(w->incoming, w->incoming_capacity, head.count))
        return model_log(i, MODEL_ERROR, "memory is short for %u packets", (unsigned)head.count);
    for (uint32_t k = 0; k < head.count; k++) {
        Packet packet = packet_at(binary, k);
        w->incoming[k] = packet.id;
        if (is_known(w, packet.id)) continue; /* the input is held over several steps */
        status = check_packet(i, w, s, mac_header, k, &packet);
        if (status != MODEL_OK) return status;
    }
    for (uint32_t k = head.count; k-- > 0;) { /* the last one first, see waiting_add */
        Transmission added = {.packet = packet_at(binary, k)};
        if (is_known(w, added.packet.id)) continue;
        added.time = added.packet.time * NANOSECOND;
        if (added.time < now) added.time = now;
        added.transmitter = added.packet.source;
        if (waiting_add(w, &added))
            return model_log(i, MODEL_ERROR, "memory is short for %u packets", (unsigned)head.count);
    }
    return remember(i, w, head.count);
}
