#include "access_category.h"

/* IEEE 802.11-2020, table 9-157: AIFSN 9, 6, 3, 2; aCWmin 15, aCWmax 1023. */
const AccessRules ACCESS_RULES[CATEGORIES] = {
    [BACKGROUND] = {SIFS + 9 * SLOT, 15, 1023},
    [BEST_EFFORT] = {SIFS + 6 * SLOT, 15, 1023},
    [VIDEO] = {SIFS + 3 * SLOT, 7, 15},
    [VOICE] = {SIFS + 2 * SLOT, 3, 7},
};
