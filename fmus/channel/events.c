#include "events.h"
#include "buffer.h"

bool event_is_before(const Event *a, const Event *b) {
    if (a->time != b->time) return a->time < b->time;
    if (a->kind != b->kind) return a->kind < b->kind;
    if (a->key != b->key) return a->key < b->key;
    return a->hop < b->hop;
}

int events_add(Events *e, const Event *added) {
    if (BUFFER_RESERVE(e->item, e->capacity, e->count + 1)) return 1;
    size_t at = e->count++;
    while (at > 0) {
        size_t parent = (at - 1) / 2;
        if (!event_is_before(added, &e->item[parent])) break;
        e->item[at] = e->item[parent];
        at = parent;
    }
    e->item[at] = *added;
    return 0;
}

void events_replace_first(Events *e, const Event *event) {
    Event moved = *event; /* it may lie in the heap */
    size_t at = 0;
    for (size_t child; (child = 2 * at + 1) < e->count; at = child) {
        if (child + 1 < e->count && event_is_before(&e->item[child + 1], &e->item[child])) child++;
        if (!event_is_before(&e->item[child], &moved)) break;
        e->item[at] = e->item[child];
    }
    e->item[at] = moved;
}

void events_drop_first(Events *e) {
    e->count--;
    if (e->count > 0) events_replace_first(e, &e->item[e->count]);
}

void events_free(Events *e) {
    free(e->item);
    *e = (Events){0};
}
