/* Time inside the channel is counted in picoseconds: a wave takes 3.3 ns for a metre, and of two
 * frames that arrive within a nanosecond a receiver turns to the first. Signals and records have
 * nanoseconds. 64 bits reach for a hundred days; half of them are allowed, so that the difference
 * of any two times fits, too. */
#ifndef CLOCK_H
#define CLOCK_H
#include <math.h>
#include <stdint.h>

#define NANOSECOND INT64_C(1000) /* [ps] */
#define MICROSECOND (1000 * NANOSECOND)
#define LAST_SECOND 4e6 /* [s] */
#define NEVER INT64_MAX /* [ps] */

/* Whole nanoseconds, in which all components count. */
static inline int64_t from_seconds(double t) { return llround(t * 1e9) * NANOSECOND; }

/* Ends are told with the first nanosecond that is not before them, beginnings with the last one that
 * is not after them: both then lie within the step that they belong to. */
static inline int64_t nanoseconds_up(int64_t t) {
    int64_t whole = t / NANOSECOND;
    return whole + (t > whole * NANOSECOND);
}
static inline int64_t nanoseconds_down(int64_t t) {
    int64_t whole = t / NANOSECOND;
    return whole - (t < whole * NANOSECOND);
}

#endif
