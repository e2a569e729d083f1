#pragma once

/* 6: write to address 0; 7: abort; 8: exit with code 0; 9: loop for ever; 10: go to another directory;
 * 11: fill 1 GB of memory, and loop for ever; 12: end the process without a word. */
void misbehave(int deed);
