/* The access categories of EDCA, and what sets them apart outside the context of a BSS. */
#ifndef ACCESS_CATEGORY_H
#define ACCESS_CATEGORY_H
#include "clock.h"

/* In the order of their priority. */
typedef enum { BACKGROUND, BEST_EFFORT, VIDEO, VOICE, CATEGORIES } AccessCategory;

/* The AIFS [ps], and the bounds of the contention window [slot]. */
typedef struct { int64_t aifs; uint32_t smallest, largest; } AccessRules;
extern const AccessRules ACCESS_RULES[CATEGORIES];

/* IEEE 802.11-2020, table 17-21, 10 MHz. */
#define SLOT (13 * MICROSECOND)
#define SIFS (32 * MICROSECOND)

#endif
