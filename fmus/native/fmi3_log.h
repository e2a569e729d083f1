/* What an instance says to the importer; model_log and fmi3SetDebugLogging stand in fmi3_log.c, too. */
#ifndef FMI3_LOG_H
#define FMI3_LOG_H
#include <limits.h>

#include "fmi3_instance.h"

/* A mask of all messages, those of categories to come included. */
#define ALL_CATEGORIES UINT_MAX

const char *mode_name(Mode);
/* Log that a call of `function` is refused, and why; returns fmi3Error. */
fmi3Status refuse(Instance *, const char *function, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Refuse a call that the mode does not allow. */
fmi3Status refuse_mode(Instance *, const char *function);

#endif
