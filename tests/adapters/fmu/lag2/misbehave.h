#pragma once

/* 6: write to address 0; 7: abort; 8: exit with code 0; 9: loop for ever; 10: go to another directory;
 * 11: fill 1 GB of memory, and loop for ever; 12: end the process without a word. */
void misbehave(int deed);

/* Further values of `fail_as`, for steps that cross `fail_at`: it comes as far as that and asks for the end; it comes
 * to its end and asks for the end; it comes as far as that. And for all steps behind it: only short ones are made. In
 * all of these cases the status is fmi2Discard. */
enum { ENDS_WITHIN = 13, ENDS_BEHIND, PAUSES, ONLY_SHORT };
#define SHORT 0.03 /* [s] */
