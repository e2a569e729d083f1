/* Which patches of a scan are one surface, and which surfaces may be of one body. */
#ifndef NEIGHBOURS_H
#define NEIGHBOURS_H
#include "search.h"

/* The root of a patch's tree, its patch with the lowest index. */
uint32_t root_of(Search *, uint32_t patch);
/* Join two trees; returns the root. */
uint32_t join_roots(Search *, uint32_t a, uint32_t b);
/* Find the surfaces and the links between them, given the first four members. */
int neighbours_find(Search *, Problem *);
void neighbours_free(Search *);

#endif
