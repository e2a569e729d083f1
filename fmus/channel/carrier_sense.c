#include "carrier_sense.h"
#include "interference.h"
#include "medium_access.h"
#include "schedule.h"

void become_busy(Channel *c, Radio *r, int64_t now) {
    r->is_idle = false;
    r->busy_since = now;
    if (c->parameters.medium_access) access_medium_busy(r, now);
}

int sense_silence(Channel *c, uint32_t radio, int64_t now) {
    Radio *r = &c->radios.item[radio];
    if (c->frames.count > 0
        && power_on_air(c, radio, now, LOWER_EDGE, NULL) >= c->parameters.cca_threshold)
        return 0;
    r->is_idle = true;
    r->idle_since = now;
    r->busy_time += now - r->busy_since;
    if (!c->parameters.medium_access) return 0;
    access_medium_idle(r, now);
    return schedule_contention(c, radio);
}

/* Let windows pass in which nothing happens; all have the ratio of the one that comes after them. */
static void skip_windows(Channel *c, int64_t quiet_until) {
    int64_t length = c->parameters.busy_window, rest = quiet_until - c->window_ends;
    if (rest < length) return;
    c->window_ends += rest / length * length;
    for (size_t k = 0; k < c->radios.count; k++)
        if (!c->radios.item[k].is_idle) c->radios.item[k].busy_since = c->window_ends - length;
}

int end_busy_window(Channel *c, int64_t quiet_until) {
    int64_t now = c->window_ends, length = c->parameters.busy_window;
    for (size_t k = 0; k < c->radios.count; k++) {
        Radio *r = &c->radios.item[k];
        if (!r->is_idle) {
            r->busy_time += now - r->busy_since;
            r->busy_since = now;
        }
        int64_t begun = now - length > r->entered ? now - length : r->entered;
        r->busy_ratio = now > begun ? (double)r->busy_time / (double)(now - begun) : 0;
        r->busy_time = 0;
    }
    c->window_ends += length;
    skip_windows(c, quiet_until);
    return schedule_window(c);
}
