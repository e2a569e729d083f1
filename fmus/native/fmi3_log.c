#include "fmi3_log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const CATEGORIES[] = {
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal",
};
#define CATEGORY_COUNT (sizeof CATEGORIES / sizeof CATEGORIES[0])

static void pass_on(Instance *instance, ModelStatus status, const char *message) {
    /* FMI 3.0.2, 2.2.4: errors are logged whether logging is on or not. */
    bool is_wanted = status >= MODEL_ERROR || (instance->log_mask >> status & 1u) != 0;
    if (instance->log && is_wanted)
        instance->log(instance->environment, (fmi3Status)status, CATEGORIES[status], message);
}

ModelStatus model_log(Instance *instance, ModelStatus status, const char *format, ...) {
    char message[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    pass_on(instance, status, message);
    return status;
}

fmi3Status refuse(Instance *instance, const char *function, const char *format, ...) {
    char reason[1600], message[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reason, sizeof reason, format, arguments);
    va_end(arguments);
    snprintf(message, sizeof message, "%s: %s", function, reason);
    pass_on(instance, MODEL_ERROR, message);
    return fmi3Error;
}

const char *mode_name(Mode mode) {
    static const char *const NAMES[] = {
        "the state Instantiated", "Configuration Mode", "Initialization Mode", "Event Mode",
        "Step Mode", "Reconfiguration Mode", "the state Terminated",
        "the state Terminated (after an error)",
    };
    return NAMES[mode];
}

fmi3Status refuse_mode(Instance *instance, const char *function) {
    return refuse(instance, function, "not allowed in %s", mode_name(instance->mode));
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    Instance *instance = c;
    if (!instance) return fmi3Error;
    unsigned mask = nCategories == 0 ? ALL_CATEGORIES : 0;
    for (size_t i = 0; i < nCategories; i++) {
        size_t k = 0;
        while (k < CATEGORY_COUNT && strcmp(categories[i], CATEGORIES[k]) != 0) k++;
        if (k == CATEGORY_COUNT)
            return refuse(instance, __func__, "there is no log category `%s`", categories[i]);
        mask |= 1u << k;
    }
    instance->log_mask = loggingOn ? instance->log_mask | mask : instance->log_mask & ~mask;
    return fmi3OK;
}
