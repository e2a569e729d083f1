/* Which links between surfaces are within one body. */
#ifndef PLAUSIBLE_H
#define PLAUSIBLE_H
#include "search.h"

/* Whether what a link joins may be one body. */
int is_plausible(const Search *, const Link *);

#endif
