/* What a step tells: records for the Binary outputs. */
#ifndef REPORTS_H
#define REPORTS_H
#include "fmi3_model.h"
#include "records.h"

/* Each is a frame of records in the making, head included. */
typedef struct {
    Binary receptions; /* in the order of the events that ended them */
    Binary transmissions;
} Reports;

/* One more record, uninitialised; NULL if memory is short. A reception is reported with its power
 * [mW] and SNIR as factors. */
Reception *report_reception(Reports *);
TransmissionRecord *report_transmission(Reports *);

/* The transmissions that have been reported and not yet released. */
const TransmissionRecord *reported_transmissions(const Reports *, size_t *count);

/* Hand all reports, in the order of fmus/messages/records.py, to the outputs and begin anew; nonzero if memory
 * is short. */
int reports_release(Reports *, Binary *receptions, Binary *transmissions);
/* Forget all reports. */
void reports_clear(Reports *);
void reports_free(Reports *);

#endif
