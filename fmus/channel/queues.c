#include "queues.h"
#include "buffer.h"

int queue_add(QueueStore *s, Queue *q, const Transmission *frame) {
    uint32_t at = s->free;
    if (s->count > 0 && at != NO_FRAME) {
        s->free = s->item[at].next;
    } else {
        if (s->count >= NO_FRAME - 1 || BUFFER_RESERVE(s->item, s->capacity, s->count + 1)) return 1;
        if (s->count == 0) s->free = NO_FRAME;
        at = (uint32_t)s->count++;
    }
    s->item[at] = (Queued){*frame, NO_FRAME};
    if (q->count++ == 0) q->first = at;
    else s->item[q->last].next = at;
    q->last = at;
    return 0;
}

Transmission queue_take(QueueStore *s, Queue *q) {
    uint32_t at = q->first;
    Transmission frame = s->item[at].frame;
    q->first = s->item[at].next;
    if (--q->count == 0) *q = EMPTY_QUEUE;
    s->item[at].next = s->free;
    s->free = at;
    return frame;
}

const Transmission *queue_first(const QueueStore *s, const Queue *q) {
    return &s->item[q->first].frame;
}

void queues_clear(QueueStore *s) {
    s->count = 0;
    s->free = NO_FRAME;
}

void queues_free(QueueStore *s) {
    free(s->item);
    *s = (QueueStore){.free = NO_FRAME};
}
