#include "reports.h"
#include "decibel.h"
#include "sort.h"
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Room for one more record, and for the head if it is the first. Both sizes are multiples of 8, so
 * that all records are aligned. */
static void *add(Binary *binary, size_t size) {
    size_t at = binary->size > 0 ? binary->size : sizeof(Frame);
    if (binary_reserve(binary, at + size)) return NULL;
    binary->size = at + size;
    return binary->data + at;
}

Reception *report_reception(Reports *r) { return add(&r->receptions, sizeof(Reception)); }

TransmissionRecord *report_transmission(Reports *r) {
    return add(&r->transmissions, sizeof(TransmissionRecord));
}

static size_t count_of(const Binary *binary, size_t record_size) {
    return binary->size == 0 ? 0 : (binary->size - sizeof(Frame)) / record_size;
}

static void *records(const Binary *binary) {
    return binary->size == 0 ? NULL : binary->data + sizeof(Frame);
}

const TransmissionRecord *reported_transmissions(const Reports *r, size_t *count) {
    *count = count_of(&r->transmissions, sizeof(TransmissionRecord));
    return records(&r->transmissions);
}

static bool is_sent_before(const TransmissionRecord *a, const TransmissionRecord *b) {
    if (a->time != b->time) return a->time < b->time;
    if (a->packet != b->packet) return a->packet < b->packet;
    return a->hop < b->hop;
}

static bool is_received_before(const Reception *a, const Reception *b) {
    if (a->time != b->time) return a->time < b->time;
    if (a->packet != b->packet) return a->packet < b->packet;
    if (a->hop != b->hop) return a->hop < b->hop;
    return a->receiver < b->receiver;
}

/* Only what happened within one nanosecond is out of order. */
DEFINE_INSERTION_SORT(sort_transmissions, TransmissionRecord, is_sent_before)
DEFINE_INSERTION_SORT(sort_receptions, Reception, is_received_before)

/* Write the head and let the output have the bytes in exchange for its old ones. */
static int release(Binary *made, const char magic[4], size_t record_size, Binary *output) {
    if (made->size == 0) {
        if (binary_reserve(made, sizeof(Frame))) return 1;
        made->size = sizeof(Frame);
    }
    size_t count = count_of(made, record_size);
    if (count > UINT32_MAX) return 1;
    Frame head = {.version = 1, .count = (uint32_t)count, .record_size = (uint32_t)record_size};
    memcpy(head.magic, magic, 4);
    memcpy(made->data, &head, sizeof head);
    Binary old = *output;
    *output = *made;
    *made = old;
    made->size = 0;
    return 0;
}

/* From factors to decibels, one after the other, so that a processor overlaps them. */
static void make_decibels(Reception *item, size_t n) {
    for (size_t i = 0; i < n; i++) {
        item[i].power_dbm = to_db(fmax(item[i].power_dbm, 1e-300)); /* it may have underflown */
        if (!isnan(item[i].snir_db)) item[i].snir_db = to_db(fmax(item[i].snir_db, 1e-300));
    }
}

int reports_release(Reports *r, Binary *receptions, Binary *transmissions) {
    size_t count = count_of(&r->receptions, sizeof(Reception));
    make_decibels(records(&r->receptions), count);
    sort_receptions(records(&r->receptions), count);
    sort_transmissions(records(&r->transmissions),
                       count_of(&r->transmissions, sizeof(TransmissionRecord)));
    return release(&r->receptions, "RCPT", sizeof(Reception), receptions)
        || release(&r->transmissions, "SENT", sizeof(TransmissionRecord), transmissions);
}

void reports_clear(Reports *r) { r->receptions.size = r->transmissions.size = 0; }

void reports_free(Reports *r) {
    free(r->receptions.data);
    free(r->transmissions.data);
    *r = (Reports){0};
}
